# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What comes from outside: files that a user names, records, messages, as declared values.

A dataclass is all the declaration there is. Its annotations say the types, `describe_field` the
ranges, `__post_init__` what else must hold; `decode_value` does the rest. Nothing that is read is
trusted: a text is bounded in size and depth before it is parsed, and a message shows no more than
a part.
"""

from __future__ import annotations

import base64
import dataclasses
import enum
import functools
import json
import re
import stat
import types
import typing
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NoReturn, TypeVar

import numpy as np

from . import atomic_files
from .errors import ErrorCode, Rejected
from .schema import Description, describe_expected, is_valid_value, make_printable

ANY_VALUE = Description('')
"""Of a field that is not described."""

Some = TypeVar('Some')


class DecodeError(Rejected, ValueError):
    """What was read is not what is declared. The errors of our kinds of files derive from it.

    Attributes:
        field: Key that is wrong, as `kick.speeds`, or that holds what is; empty if it is all.
    """


# --- texts ------------------------------------------------------------------------------------


def read_file(path: Path | str) -> str:
    """Return the content of a regular file in UTF-8; see `atomic_files.read_text`.

    Raises:
        DecodeError: There is none, or it cannot be read; the message does not name it.
    """
    try:
        return atomic_files.read_text(Path(path))
    except (OSError, ValueError) as error:
        why = atomic_files.describe_error(error)
        raise DecodeError(ErrorCode.UNREADABLE, reason=why) from error


def require_regular(path: Path) -> None:
    """Make sure that what a library will open is a file or folder: a pipe may never end.

    Raises:
        DecodeError: It is not, or not there; the message does not name it.
    """
    try:
        mode = path.stat().st_mode
    except (OSError, ValueError) as error:
        why = atomic_files.describe_error(error)
        raise DecodeError(ErrorCode.UNREADABLE, reason=why) from error
    if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):
        raise DecodeError(ErrorCode.UNREADABLE, reason='it is not a regular file')


def parse_json(text: str | bytes) -> Any:
    """Return what a JSON text holds; raises `DecodeError`."""
    try:
        return json.loads(text, parse_constant=_refuse_constant)
    except RecursionError:
        raise _malformed('JSON', 'it is nested too deeply') from None
    except ValueError as error:
        raise _malformed('JSON', make_printable(str(error), 100)) from error


def _malformed(language: str, why: str) -> DecodeError:
    return DecodeError(ErrorCode.MALFORMED, reason=f'it must be {language}; {why}')


def _refuse_constant(name: str) -> NoReturn:
    raise ValueError(f'{name} is not JSON')


def parse_yaml(text: str, *, texts: bool = False) -> Any:
    """Return what a YAML text holds, every scalar as a text if wanted; raises `DecodeError`.

    What an alias stands for counts each time: a kilobyte of them can stand for gigabytes.
    """
    import yaml  # type: ignore[import-untyped]

    fast = 'C' if hasattr(yaml, 'CBaseLoader') else ''  # PyYAML may be without libyaml
    base = getattr(yaml, f'{fast}BaseLoader')
    loader = base if texts else _value_loader()
    try:
        nodes, inside, sizes = 0, [], {}
        for event in yaml.parse(text, base):
            nodes += 1
            if isinstance(event, yaml.CollectionStartEvent):
                inside.append((event.anchor, nodes))
            elif isinstance(event, yaml.CollectionEndEvent):
                anchor, before = inside.pop()
                sizes[anchor] = nodes - before
            elif isinstance(event, yaml.AliasEvent):  # 1 for a scalar's; not of what holds it
                nodes += sizes.get(event.anchor, 1)
                if event.anchor in (anchor for anchor, _ in inside):
                    raise _malformed('YAML', 'it holds itself')
            if len(inside) > 50:  # ours have seven levels, and a parser may overflow the stack
                raise _malformed('YAML', 'it is nested too deeply')
            if nodes > 2**21:  # an element of 100 000 cells has a fifth of these values
                raise _malformed('YAML', 'it is too large')
        single = loader(text)
        try:
            node = single.get_single_node()
            if not texts:
                _require_single_keys(node)
            return None if node is None else single.construct_document(node)
        finally:
            single.dispose()
    except DecodeError:
        raise
    except (yaml.YAMLError, ValueError, OverflowError, RecursionError) as error:
        raise _malformed('YAML', _locate_yaml_error(error)) from error


@functools.cache
def _value_loader() -> Any:
    """Return a YAML loader to which 1e-5 and 1.0e6 are numbers, as to ROS; YAML 1.1 demands a
    point and a sign.
    """
    import yaml

    class ValueLoader(getattr(yaml, 'CSafeLoader', yaml.SafeLoader)):  # type: ignore[misc]
        """A loader with a table of its own."""

    loader: Any = ValueLoader
    number = re.compile(r'[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)[eE][-+]?[0-9]+')
    loader.add_implicit_resolver('tag:yaml.org,2002:float', number, list('-+.0123456789'))
    return loader


def _require_single_keys(document: Any) -> None:
    """Raise `DecodeError` if a key stands twice in a mapping of a YAML document."""
    import yaml

    waiting, seen = [('', document)], set()
    while waiting:
        name, node = waiting.pop()
        if id(node) in seen:  # an alias stands for it
            continue
        seen.add(id(node))
        if isinstance(node, yaml.SequenceNode):
            waiting += [(name, each) for each in node.value]
        lines: dict[str, int] = {}
        for key, value in node.value if isinstance(node, yaml.MappingNode) else ():
            field, line = _join_path(name, key.value), key.start_mark.line + 1
            if (text := str(key.value)) in lines:
                why = f'it stands twice, in line {lines[text]} and in line {line}'
                raise DecodeError(ErrorCode.MALFORMED, field, reason=why)
            lines[text] = line
            waiting.append((field, value))


def find_line(text: str, field: str) -> int:
    """Return the line on which a key such as `kick.speeds` stands in a YAML text that `parse_yaml`
    read, or else the key that holds it; 0 if neither is there.
    """
    import yaml

    node, line = yaml.compose(text, _value_loader()), 0
    for key in field.partition('[')[0].split('.'):
        pairs = node.value if isinstance(node, yaml.MappingNode) else ()
        found = next((pair for pair in pairs if pair[0].value == key), None)
        if found is None:
            return line
        line, node = found[0].start_mark.line + 1, found[1]
    return line


def _locate_yaml_error(error: Exception) -> str:
    """Return what is wrong with a YAML text and where, without quoting it."""
    mark, problem = (getattr(error, f'problem{suffix}', None) for suffix in ('_mark', ''))
    if mark is None:
        return 'a value is not'
    quotes = type(error).__name__ in ('ComposerError', 'ConstructorError')  # an anchor or a tag
    what = '' if quotes or not problem else f': {problem}'
    return f'line {mark.line + 1}, column {mark.column + 1} is not{what}'


# --- values -----------------------------------------------------------------------------------


def decode_value(
    kind: type[Some] | Any, data: Any, name: str = '', given: Description = ANY_VALUE
) -> Any:
    """Return plain values, as JSON and YAML have them, as what a type declares.

    A document of another kind is refused without quoting it: a client may name any file.

    A dataclass comes from an object; a tuple, list or text of words from a list; a mapping, whose
    keys are texts or of an enum, from an object; an array from a number, a list of numbers or of
    hexadecimal ones, or the object that `encode_array` gives. Numbers are finite.

    Args:
        data: The values.
        name: What they are called in messages.
        given: The range of every number in them.

    Raises:
        DecodeError: They are no such values; the message names the place.
    """
    if kind is Any:
        return data
    if data is None and given.null is not None:
        return given.null
    origin, args = typing.get_origin(kind), typing.get_args(kind)
    if origin in (typing.Union, types.UnionType):
        return _decode_union(args, data, name, given)
    if dataclasses.is_dataclass(kind):
        return _decode_object(kind, data, name)
    if origin is np.ndarray:
        return _decode_array(data, name, given)
    if origin in (tuple, list, Sequence):
        return _decode_list(origin, args, data, name, given)
    if origin in (dict, Mapping):
        return _decode_mapping(args, data, name, given)
    if isinstance(kind, enum.EnumMeta):
        words = tuple(str(each.value) for each in list[enum.Enum](kind))
        return kind(decode_value(str, data, name, Description('', choices=words)))
    if kind is str and given.words and not isinstance(data, str):
        if not isinstance(data, list):
            raise DecodeError.out_of_range(name, data, 'a list')
        data = ' '.join(map(str, data))
    if not is_valid_value(data, kind.__name__, given):
        raise DecodeError.out_of_range(name, data, describe_expected(kind.__name__, given))
    if kind is int and not -(2**63) <= data < 2**63:
        raise DecodeError.out_of_range(name, data, 'a whole number of 64 bits')
    return float(data) if kind is float else data


def encode_value(value: Any) -> Any:
    """Return declared values as plain ones for JSON, with every bit, as `decode_value` takes them.

    A field of a dataclass that is not compared does not belong to its value, and is left out.
    """
    if dataclasses.is_dataclass(value):
        found = {}
        for each in dataclasses.fields(value):
            if each.init and each.compare:
                null = each.metadata.get('description', ANY_VALUE).null  # stands for None
                one = getattr(value, each.name)
                found[each.name] = None if null is not None and one == null else encode_value(one)
        return found
    if isinstance(value, np.ndarray):
        return encode_array(value)
    if isinstance(value, enum.Enum):
        return value.value
    if isinstance(value, Mapping):
        return {encode_value(key): encode_value(one) for key, one in value.items()}
    if isinstance(value, (list, tuple)):
        return list(map(encode_value, value))
    return value


def encode_array(values: Any) -> dict[str, Any]:
    """Return an array with every bit, as `decode_value` takes it."""
    data = np.ascontiguousarray(values, dtype='<f8').tobytes()
    return {'shape': list(values.shape), 'f8': base64.b64encode(data).decode('ascii')}


def _join_path(name: str, key: object) -> str:
    short = make_printable(str(key), 40)
    return f'{name}.{short}' if name else short


@functools.cache
def _describe_fields(kind: type) -> dict[str, tuple[Any, Description, bool]]:
    """Return type and description of every field, and whether it must be given."""
    hints = typing.get_type_hints(kind)
    missing = dataclasses.MISSING
    return {
        each.name: (
            hints[each.name],
            each.metadata.get('description', ANY_VALUE),
            each.default is missing and each.default_factory is missing,
        )
        for each in dataclasses.fields(kind)
        if each.init
    }


def _decode_object(kind: type, data: Any, name: str) -> Any:
    fields = _describe_fields(kind)
    if not isinstance(data, Mapping):
        raise DecodeError.out_of_range(name, data if name else _describe_kind(data), 'an object')
    known = ', '.join(fields)
    if not name and data and fields and not any(key in fields for key in data):
        raise DecodeError(ErrorCode.UNKNOWN_FIELD, reason=f'it has none of the keys {known}')
    for key in data:
        if key not in fields:
            raise DecodeError(ErrorCode.UNKNOWN_FIELD, _join_path(name, key), expected=known)
    for key, (_, described, needed) in fields.items():
        if needed and key not in data:
            text = described.text or 'it has no default'
            raise DecodeError(ErrorCode.MISSING_FIELD, _join_path(name, key), expected=text)
    try:
        return kind(**{
            key: decode_value(hint, data[key], _join_path(name, key), given)
            for key, (hint, given, _) in fields.items()
            if key in data
        })  # fmt: skip
    except DecodeError:
        raise
    except ValueError as error:
        raise DecodeError.of_error(error, name, code=ErrorCode.OUT_OF_RANGE) from error


def _describe_kind(data: Any) -> str:
    """Return in words what kind of value a document is."""
    if data is None:
        return 'nothing'
    return 'a list' if isinstance(data, list) else 'a text' if isinstance(data, str) else 'a value'


def _decode_union(kinds: Sequence[Any], data: Any, name: str, given: Description) -> Any:
    """Return the value of the first type that takes it; the last one says what is wrong."""
    if data is None and types.NoneType in kinds:
        return None
    *others, last = (kind for kind in kinds if kind is not types.NoneType)
    for kind in others:
        try:
            return decode_value(kind, data, name, given)
        except DecodeError:
            continue
    return decode_value(last, data, name, given)


def _decode_list(
    origin: Any, kinds: Sequence[Any], data: Any, name: str, given: Description
) -> Any:
    if not isinstance(data, (list, tuple)):
        raise DecodeError.out_of_range(name, data, 'a list')
    if origin is not tuple or kinds[-1:] == (...,):
        kinds = [kinds[0]] * len(data)
    elif len(data) != len(kinds):
        raise DecodeError.out_of_range(name, data, f'a list of {len(kinds)}')
    values = (
        decode_value(kind, value, f'{name}[{place}]', given)
        for place, (kind, value) in enumerate(zip(kinds, data, strict=True))
    )
    return list(values) if origin is list else tuple(values)


def _decode_mapping(
    kinds: Sequence[Any], data: Any, name: str, given: Description
) -> dict[Any, Any]:
    key, value = kinds
    if not isinstance(data, Mapping):
        raise DecodeError.out_of_range(name, data, 'an object')
    return {
        decode_value(key, each, f'a key of {name}'): decode_value(
            value, item, _join_path(name, each), given
        )
        for each, item in data.items()
    }


def _decode_array(data: Any, name: str, given: Description) -> Any:
    what = 'a list of finite numbers'
    found: Any
    try:
        if isinstance(data, Mapping):
            raw = base64.b64decode(data['f8'], validate=True)
            found = np.frombuffer(raw, dtype='<f8').reshape(data['shape']).astype(np.float64)
        elif isinstance(data, list):
            found = np.array([_parse_number(each) for each in data], dtype=np.float64)
        else:
            found = np.float64(_parse_number(data))
    except (LookupError, TypeError, ValueError, OverflowError) as error:
        raise DecodeError.out_of_range(name, data, what) from error
    low = -np.inf if given.low is None else given.low
    high = np.inf if given.high is None else given.high
    right = np.isfinite(found) & (found >= low) & (found <= high)
    if not right.all():
        worst = float(np.atleast_1d(found)[~np.atleast_1d(right)].flat[0])
        raise DecodeError.out_of_range(
            name, worst, f'{what}: each {describe_expected("float", given)}'
        )
    return np.asarray(found)


def _parse_number(data: Any) -> float:
    if isinstance(data, str) and data.lstrip('-').startswith('0x'):
        return float.fromhex(data)
    if type(data) not in (int, float):
        raise TypeError
    return float(data)
