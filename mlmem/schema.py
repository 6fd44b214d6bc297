# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Dataclass fields that describe themselves: meaning, unit and range, declared once.

Checks, ROS parameters and the tables of the documentation are made from them. In a message a value
from outside is told by `short_repr`: short, printable, and on one line.
"""

from __future__ import annotations

import dataclasses
import reprlib
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

MAX_MESSAGE_CHARS = 1000
"""Most characters of the sentence of an error."""


@dataclass(frozen=True)
class Description:
    """The description of a field.

    Attributes:
        text: One descriptive phrase.
        unit: Unit symbol; empty for counts, names and ratios.
        low: Smallest legal value, or None.
        high: Largest legal value, or None.
        choices: The legal words of a text field; empty if every word is legal.
        words: What the words of a text field are, which spaces separate; empty if it is one text.
        word: Whether a text is such a word; a `ValueError` says no, too.
        null: What a file's null stands for: JSON has no infinity.
    """

    text: str
    unit: str = ''
    low: float | None = None
    high: float | None = None
    choices: tuple[str, ...] = ()
    words: str = ''
    word: Callable[[str], bool] = bool
    null: Any = None


def describe_field(
    default: Any, text: str, kind: type[Description] = Description, **more: Any
) -> Any:
    """Return a dataclass field with a default (`dataclasses.MISSING` if it is required), and with
    a description of some kind.
    """
    return dataclasses.field(default=default, metadata={'description': kind(text, **more)})


def make_field_factory(unit: str, least: float, most: float, **common: Any) -> Callable[..., Any]:
    """Return what makes fields of one unit, within these values if a field names no others; the
    rest of their descriptions is common to them.
    """

    def make_field(
        default: float, text: str, low: float = least, high: float = most, **more: Any
    ) -> Any:
        return describe_field(default, text, unit=unit, low=low, high=high, **common, **more)

    return make_field


describe_time = make_field_factory('time', 0.0, 1e6)
"""Returns a field of a duration in time units."""


def find_descriptions(owner: Any) -> Iterator[tuple[dataclasses.Field[Any], Description]]:
    """Yield every described field of a dataclass or of its instance."""
    for field in dataclasses.fields(owner):
        if 'description' in field.metadata:
            yield field, field.metadata['description']


class Problem(NamedTuple):
    """A value that is not what it must be.

    Attributes:
        field: Its name.
        expected: What it must be, in words.
    """

    field: str
    value: object
    expected: str


def find_problems(instance: Any, **most: float) -> list[Problem]:
    """Return what is wrong with the described fields of a dataclass instance.

    `most` are largest legal values that only the caller knows, by field. The annotation gives the
    type: `int` accepts whole numbers only, `float` accepts both, and neither accepts a bool.
    """
    found = []
    for field, description in find_descriptions(instance):
        value = getattr(instance, field.name)
        if field.name in most:
            description = dataclasses.replace(description, high=most[field.name])
        kind = field.type if isinstance(field.type, str) else field.type.__name__
        if not is_valid_value(value, kind, description):
            found.append(Problem(field.name, value, describe_expected(kind, description)))
    return found


def is_valid_value(value: Any, kind: str, description: Description) -> bool:
    """Return whether a value is of a type, given by name, and in range."""
    if kind == 'bool':
        return isinstance(value, bool)
    if kind == 'str':
        return isinstance(value, str) and _is_valid_text(value, description)
    if isinstance(value, bool) or not isinstance(value, int if kind == 'int' else (int, float)):
        return False
    if kind == 'float' and not abs(value) <= sys.float_info.max:  # 10**400 neither
        return False
    above = description.low is None or value >= description.low
    below = description.high is None or value <= description.high
    return above and below


def is_number(value: object, limit: float) -> bool:
    """Return whether a value is a number of at most this magnitude; NaN and bools are not."""
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    return number and abs(value) <= limit  # type: ignore[arg-type]


def _is_valid_text(value: str, description: Description) -> bool:
    if description.choices:
        return value in description.choices
    try:
        return not description.words or all(map(description.word, value.split()))
    except ValueError:
        return False


def describe_expected(kind: str, description: Description) -> str:
    """Return in words what `is_valid_value` accepts."""
    if kind == 'bool':
        return 'true or false'
    if kind == 'str':
        if description.words:
            return f'{description.words} separated by spaces'
        return describe_choices(description.choices) if description.choices else 'a text'
    noun = 'a whole number' if kind == 'int' else 'a finite number'
    low, high = map(_format_bound, (description.low, description.high))
    if low and low == high:
        return low
    if low and high:
        return f'{noun} from {low} to {high}'
    if low:
        return f'{noun} of at least {low}'
    return f'{noun} of at most {high}' if high else noun


def describe_choices(choices: Sequence[str]) -> str:
    """Return in words what a text may be, such as `one of left, right, or empty`."""
    return f'one of {", ".join(filter(None, choices))}' + (', or empty' if '' in choices else '')


def _format_bound(value: float | None) -> str:
    return '' if value is None else str(value) if isinstance(value, int) else f'{value:g}'


def short_repr(value: object, most: int = 80) -> str:
    """Return the `repr` of a value, without its middle if it is long.

    The whole `repr` is never built: for a joint name of 5 MB, deeply nested lists or YAML full of
    aliases it would cost more than the value.

    Args:
        value: Anything; text keeps its quotes, with control characters escaped.
        most: Greatest length in characters, at least 5.
    """
    short = reprlib.Repr()
    short.maxlevel = 3
    short.maxlist = short.maxtuple = short.maxdict = short.maxset = short.maxarray = 6
    short.maxstring = short.maxlong = short.maxother = most
    try:
        text = short.repr(value[:most] if isinstance(value, bytes) else value)
    except ValueError:  # Python writes no whole number of more than 4300 digits
        text = '<a number of thousands of digits>'
    return _shorten_text(text, most)


def make_printable(text: str, most: int = MAX_MESSAGE_CHARS) -> str:
    """Return a text, whatever it is, as one line of at most `most` characters that a terminal
    displays without interpreting it.
    """
    shown = _shorten_text(text, most)  # cut first: every character may take ten
    if shown.isprintable():
        return shown
    return _shorten_text(''.join(c if c.isprintable() else repr(c)[1:-1] for c in shown), most)


def _shorten_text(text: str, most: int) -> str:
    if len(text) <= most:
        return text
    head = (most - 3) * 2 // 3
    return f'{text[:head]}...{text[len(text) - (most - 3 - head) :]}'
