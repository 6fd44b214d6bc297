# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How a request ended: what an answer holds, declared once, and every shape that it takes.

A field of an `Answer` made by `declare_field` is all the declaration there is: its name, its
type, its unit and what stands for it where there is none. From it follow the JSON object of a
service and the texts of `~/outcome` (`outcome_to_dict`), the result of an action
(`build_result`), what a client makes of either (`decode_answer`), the line of a command, the
table of the reference, and the definition of the action.
"""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, dataclass, field
from functools import cache
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from mlmem import ErrorCode, Rejected
from mlmem.parsing import DecodeError, decode_value, parse_json
from mlmem.procedure_table import BLANK, JOINT_NAME, UNDECODABLE, UNSET_CONTENT
from mlmem.schema import Description, short_repr

from .requests import WRITE_ARGUMENTS
from .topics import OK, parse_status

if TYPE_CHECKING:
    from mlmem import Outcome

# --- what it holds ----------------------------------------------------------------------------


@dataclass(frozen=True)
class ResultField(Description):
    """One value of a result, wherever it appears.

    Attributes:
        wire: Type of its field in an action's result; empty if it has none of this name.
        absent: What stands there for none; None: what its type has by default.
        short: Another name that it goes by as well, in messages.
        default: What an answer has where it is not known; `MISSING` if it is always there.
    """

    wire: str = ''
    absent: Any = None
    short: str = ''
    default: Any = field(default_factory=lambda: MISSING)


def declare_field(
    wire: str, text: str, unit: str = '', *, default: Any = MISSING, **more: Any
) -> Any:
    """Return a field of an answer; one with a default is left out where it is not known.

    The device measures it under this name: as an attribute of an outcome or of its reading, or as
    one of what its procedure has `found`. A mapping is by end, and one field for each of them in
    an action's result.
    """
    row = ResultField(text, unit, wire=wire, default=default, **more)
    return field(default=default, metadata={'description': row}, kw_only=True)


@dataclass(frozen=True)
class Answer:
    """The answer to a request that succeeded.

    Attributes:
        details: The node's whole answer, by the names in its JSON object.
    """

    details: Mapping[str, Any] = field(repr=False, compare=False)


@dataclass(frozen=True)
class Done(Answer):
    """A procedure that succeeded."""

    attempts: int = declare_field('uint32', 'number of attempts')
    ticks: int = declare_field('uint64', 'duration', 'ticks of the device')


@dataclass(frozen=True)
class Decoded(Done):
    """The answer of write, read and erase: the content as decoded from its echo."""

    level: int | None = declare_field(
        'int64',
        'content of one wall as last read, from 0 to p - 1; -1 blank; -2 undecodable or unknown',
        default=None,
        absent=UNDECODABLE,
    )
    word: int | None = declare_field(
        'int64',
        'in its place, content of a register as last read; -2 undecodable or unknown',
        default=None,
        absent=UNDECODABLE,
    )
    code: str = declare_field('string', 'binary code of the level; empty without a level')
    end: str = declare_field('string', 'the end that was probed: left, right or both')
    delay: float | None = declare_field(
        'float64', 'of the echo (of both ends: at the left)', 'time units', absent=math.nan
    )
    right_delay: float | None = declare_field(
        'float64',
        'at the right end, if both were probed',
        'time units',
        default=None,
        absent=math.nan,
    )
    level_margin: float = declare_field(
        'float64', '1 at the calibrated delay, 0 half-way to the next level', '1', short='margin'
    )
    threshold_margin: float = declare_field(
        'float64', 'greatest envelope v_c over the threshold; above 1: an echo', '1'
    )
    confidence: float = declare_field(
        'float64', 'how much may be lost before the answer changes, 0 ... 1', '1'
    )
    walls: int | None = declare_field(
        'int8', 'number of walls as the ends show; 3: 3 or more', default=None, absent=-1
    )
    reason: str = declare_field(
        'string', 'why the echo could not be decoded; empty if it could', default=''
    )

    @property
    def content(self) -> int:
        """The level of one wall or the word of a register; -2 if it is not known."""
        known = self.word if self.level is None else self.level
        return UNDECODABLE if known is None else known

    @property
    def blank(self) -> bool:
        """Whether the element holds no level."""
        return self.level == BLANK


@dataclass(frozen=True)
class Calibrated(Decoded):
    """The answer of calibrate: the restored content, and what was measured: delays of an element
    that is read by them, the factors on losses and kicks of one that is read by
    waveforms.
    """

    delays: Mapping[str, tuple[float, ...]] | None = declare_field(
        'float64[]',
        'measured delay of every level, by the end that receives it',
        'time units',
        default=None,
    )
    loss_factor: float | None = declare_field(
        'float64', 'damping and friction over those of the design', '1', default=None,
        absent=math.nan,
    )  # fmt: skip
    kick_factor: float | None = declare_field(
        'float64', 'mean of the factors found on the speeds of kicks', '1', default=None,
        absent=math.nan,
    )  # fmt: skip


@dataclass(frozen=True)
class Located(Decoded):
    """The answer of locate: the content, and where the walls are."""

    walls: int | None = declare_field('int8', 'number of walls', default=None, absent=-1)
    position: float | None = declare_field('float64', 'of the wall', 'cells', default=None)
    position_std: float | None = declare_field(
        'float64', 'its standard deviation', 'cells', default=None
    )
    cells: str = declare_field(
        'string', 'of all walls, from the left, if there may be many', default=''
    )
    kinds: str = declare_field('string', 'of all walls: wall or kink', default='')
    stuck_cell: int | None = declare_field(
        'int64', 'of a blank element, if one is there and answers', 'cell', default=None
    )


@dataclass(frozen=True)
class Surveyed(Decoded):
    """The answer of survey: the restored content, and what was recorded."""

    shots: int = declare_field('uint32', 'number of pulses whose waveforms were published')


@dataclass(frozen=True)
class SelfTested(Answer):
    """A completed self-test, whatever its result.

    Attributes:
        passed: Whether every check passed.
        checks: Result of every check, by name: transducers, erase, actuator, levels, restore.
        failed: Names of the checks that did not pass.
    """

    passed: bool
    checks: Mapping[str, str]
    failed: tuple[str, ...]


@dataclass(frozen=True)
class Paused(Answer):
    """Whether time is paused, as it is after a single tick too.

    Attributes:
        tick: Ticks the device has done.
        paused: True while it is.
    """

    tick: int
    paused: bool = True


@dataclass(frozen=True)
class Recorded(Answer):
    """Whether a session is recorded.

    Attributes:
        recording: True while it is.
        path: Its bag, on the node's machine.
    """

    recording: bool
    path: str


ANSWER_TYPES: dict[str, type[Answer]] = {
    'calibrate': Calibrated,
    'self_test': SelfTested,
    'locate': Located,
    'survey': Surveyed,
    'kick': Done,
    'abort': Done,
    'follow': Answer,
    'record': Recorded,
}
"""Types of successful answers by request; those of all others are `Decoded`."""


def describe_fields(kind: type[Answer]) -> Iterator[tuple[str, ResultField]]:
    """Yield name and description of what an answer holds, in the order of an action's result."""
    rows = _select_fields(kind)
    order = dict.fromkeys((*Decoded.__annotations__, *Done.__annotations__, *rows))
    yield from ((name, rows[name]) for name in order if name in rows)


def _select_fields(kind: type[Answer]) -> dict[str, ResultField]:
    return {
        each.name: each.metadata['description']
        for each in dataclasses.fields(kind)
        if 'description' in each.metadata
    }


# --- the node's side --------------------------------------------------------------------------


def outcome_to_dict(outcome: Outcome) -> dict[str, Any]:
    """Return what a finished procedure tells, as plain values by name."""
    values: dict[str, Any] = {'procedure': outcome.procedure}
    if outcome.error:
        values['error'] = outcome.error
    for name, each in list_all_fields().items():
        own = hasattr(outcome, name) and name != 'code'  # which is the binary one of the reading
        value = getattr(outcome if own else outcome.reading, name, each.default)
        if value not in (each.default, {}):
            values[name] = _to_plain(value)
    if outcome.checks:
        values['checks'] = {check.name: check.message for check in outcome.checks}
    values |= outcome.found
    return values | {
        row.short: values[name]
        for name, row in list_all_fields().items()
        if row.short and name in values
    }


def format_values(values: Mapping[str, Any]) -> dict[str, str]:
    """Return values as the texts that diagnostics carry.

    Lists are separated by spaces, and a mapping is one text for each of its keys, such as
    `delays_left`. None has none.
    """
    found: dict[str, str] = {}
    for key, value in values.items():
        if isinstance(value, Mapping):
            found |= format_values({f'{key}_{name}': item for name, item in value.items()})
        elif isinstance(value, list | tuple):
            found[key] = ' '.join(map(_format_value, value))
        elif value is not None:
            found[key] = _format_value(value)
    return found


def _format_value(value: Any) -> str:
    return f'{value:.6g}' if isinstance(value, float) else str(value)


def format_answer(outcome: Outcome, **asked: Any) -> str:
    """Return the JSON object that answers a service, along with what was asked for."""
    return json.dumps(outcome_to_dict(outcome) | asked)


def format_refusal(error: Exception) -> str:
    """Return the JSON object that answers a refused request: why, in words and as the value of an
    `ErrorCode`, and the field that is wrong, if it is one.
    """
    code = error.code if isinstance(error, Rejected) else ErrorCode.OTHER
    values = {'error': str(error) or type(error).__name__, 'error_code': code.value}
    if field_name := getattr(error, 'field', ''):
        values['field'] = field_name
    return json.dumps(values)


def build_result(
    kind: Any, error_code: int = 0, error: str = '', outcome: Outcome | None = None
) -> Any:
    """Return the result of an action: an error code of `kind.Result`, and what the outcome of its
    procedure tells, if there is one.
    """
    result = kind.Result(error_code=error_code, error=error)
    values = {} if outcome is None else outcome_to_dict(outcome)
    for name, row in list_all_fields().items():
        found = values.get(name)
        for field_name, end in wire_fields(name, row):
            value = (found or {}).get(end) if end else row.absent if found is None else found
            if value is not None and hasattr(result, field_name):
                setattr(result, field_name, value)
    return result


def list_all_fields() -> Mapping[str, ResultField]:
    """Return all that any answer holds, by name."""
    return _merge_fields((Decoded, *ANSWER_TYPES.values()))


@cache
def _merge_fields(kinds: tuple[type[Answer], ...]) -> Mapping[str, ResultField]:
    return {name: row for kind in kinds for name, row in _select_fields(kind).items()}


def wire_fields(name: str, row: ResultField) -> Iterator[tuple[str, str]]:
    """Yield the fields of an action's result, with the end that each is of."""
    if row.wire.endswith('[]'):
        yield from ((f'{end}_{name}', end) for end in ('left', 'right'))
    else:
        yield row.short or name, ''


def _to_plain(value: Any) -> Any:
    if isinstance(value, float):
        return round(value, 4)
    if isinstance(value, Mapping):
        return {name: _to_plain(each) for name, each in value.items()}
    return [_to_plain(each) for each in value] if isinstance(value, tuple) else value


# --- the client's side ------------------------------------------------------------------------

SomeAnswer = TypeVar('SomeAnswer', bound=Answer)


class RequestError(Exception):
    """A request failed; the message says why."""


class NoAnswer(RequestError):
    """The node was not found or did not answer in time: the result of the request is unknown."""


class RequestFailed(RequestError):
    """The node tried and failed; the content may have changed.

    Attributes:
        answer: The node's JSON object, with `error`.
    """

    def __init__(self, answer: Mapping[str, Any]) -> None:
        super().__init__(answer.get('error', 'the node gave no reason'))
        self.answer = answer


class RequestRefused(RequestFailed):
    """The node refused the request (busy, inactive, out of range): nothing has changed."""


class BankFailed(RequestError):
    """Some elements of a bank failed; the others succeeded.

    Attributes:
        errors: What went wrong, by the full name of the element.
    """

    def __init__(self, errors: Mapping[str, RequestError], elements: int) -> None:
        reasons = '; '.join(f'{name}: {error}' for name, error in errors.items())
        super().__init__(f'{len(errors)} of {elements} elements failed: {reasons}')
        self.errors = errors


def parse_answer(kind: type[SomeAnswer], success: bool, message: str) -> SomeAnswer:
    """Return a service's answer, one JSON object, as a value of the type that a success has.

    Raises:
        RequestRefused: The node refused the request.
        RequestFailed: It failed, or its answer is malformed.
    """
    try:
        return decode_answer(
            kind, success, decode_value(dict[str, Any], parse_json(message), 'the answer')
        )
    except DecodeError as error:
        raise RequestFailed({'error': str(error)}) from None


def decode_answer(kind: type[SomeAnswer], success: bool, said: Mapping[str, Any]) -> SomeAnswer:
    """Return a node's answer, given as values by name; raises as `parse_answer` does."""
    if not success:
        raise (RequestFailed if 'procedure' in said else RequestRefused)(said)
    known = (each.name for each in dataclasses.fields(kind))
    values = {name: said[name] for name in known if name in said}
    try:
        answer: SomeAnswer = decode_value(kind, {**values, 'details': said}, 'the answer')
    except ValueError as error:  # `DecodeError` is one
        raise RequestFailed({**said, 'error': str(error)}) from None
    return answer


def parse_result(name: str, kind: type[SomeAnswer], result: Any, goal: Any) -> SomeAnswer:
    """Return the result of an action, named like its request, as an answer; raises as
    `parse_answer` does, also where the goal was canceled.
    """
    if kind is SelfTested and not result.error_code:
        return parse_self_test(result)  # type: ignore[return-value]
    values = extract_values(name, result)
    for argument in WRITE_ARGUMENTS:
        if (content := getattr(goal, argument, UNSET_CONTENT)) != UNSET_CONTENT:
            values['asked'] = content
    return decode_answer(kind, not result.error_code, values)


def extract_values(name: str, result: Any) -> dict[str, Any]:
    """Return a result's values by the names of an answer's JSON object."""
    values: dict[str, Any] = {'error': result.error} if result.error else {}
    if result.error_code == result.REFUSED:
        return values
    values['procedure'] = name
    for key, row in list_all_fields().items():
        there = {end: field for field, end in wire_fields(key, row) if hasattr(result, field)}
        if not there:
            continue
        found = {end: _convert_received(getattr(result, field)) for end, field in there.items()}
        value = found[''] if '' in found else {end: each for end, each in found.items() if each}
        if value in (row.default, {}) or (row.default is None and value == row.absent):
            continue
        values |= dict.fromkeys(filter(None, (key, row.short)), value)
    return values


def _convert_received(value: Any) -> Any:
    """Return the value of a field, None for what is not a number."""
    if isinstance(value, float):
        return None if math.isnan(value) else value
    return value if isinstance(value, (int, str)) else list(value)


def parse_self_test(response: Any) -> SelfTested:
    """Return the answer in a diagnostic_msgs/SelfTest response.

    Raises:
        RequestRefused: The test did not run.
    """
    found = {each.name.rpartition(': ')[2]: parse_status(each) for each in response.status}
    if 'self_test' in found:
        raise RequestRefused({'error': found['self_test'].text})
    return SelfTested(
        MappingProxyType({name: status.values for name, status in found.items()}),
        passed=response.passed not in (False, b'\0'),
        checks=MappingProxyType({name: status.text for name, status in found.items()}),
        failed=tuple(name for name, status in found.items() if status.severity != OK),
    )


# --- topics, live or from a bag -----------------------------------------------------------------


def parse_echo(message: Any) -> NDArray[np.float64]:
    """Return the rows t, v_m and v_c of an echo, shape (3, n).

    Raises:
        ValueError: It is not three rows of two or more finite numbers, the times first.
    """
    data = np.asarray(message.data, dtype=np.float64)
    if len(data) < 6 or len(data) % 3 or not np.isfinite(data).all():
        raise ValueError(
            f'data must be 3 rows of 2 or more finite numbers; got {short_repr(data)}'
        )
    t = data[: len(data) // 3]
    if not 0.0 < t[0] < t[1] or not (np.diff(t) >= 0.0).all():
        raise ValueError(f'the times of the samples must increase from 0; got {short_repr(t)}')
    return data.reshape(3, -1)


def parse_displacement(message: Any) -> float:
    """Return the displacement of the substrate's end in m from a JointState.

    Raises:
        ValueError: It has none.
    """
    places = dict(zip(message.name, message.position, strict=False))
    if JOINT_NAME not in places:
        raise ValueError(f'position must include the {JOINT_NAME}; got {short_repr(places)}')
    return float(places[JOINT_NAME])
