# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The client's side of the interface: how it asks, and what it makes of what comes back.

Messages check their fields only if ROS_PYTHON_CHECK_FIELDS is 1, and never under `python -O`.
Without a check 65541 becomes 5 in a uint16, and a text where a number belongs may end the process.
So values are checked (`convert_field`) before they are converted. Messages may be live or from a
bag.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from numbers import Integral, Real
from types import MappingProxyType
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from mlmem.parsing import DecodeError, decode_value, parse_json
from mlmem.procedure_table import JOINT_NAME
from mlmem.schema import short_repr

from .answers import Answer, SelfTested, list_all_fields, wire_fields
from .services import DEADLINE_ARGUMENT, DOUBLE, NAME_ARGUMENT, REQUEST_ARGUMENTS, STRING
from .topics import OK, parse_status

SomeAnswer = TypeVar('SomeAnswer', bound=Answer)


# --- asking -----------------------------------------------------------------------------------


def build_request(name: str, **arguments: Any) -> Any:
    """Return one of `REQUEST_ARGUMENTS` as a rcl_interfaces/srv/SetParametersAtomically.Request;
    omitted arguments take the command's defaults.

    Raises:
        ValueError: There is no such request, or an argument is not of its type.
    """
    from rcl_interfaces.srv import SetParametersAtomically

    if name not in REQUEST_ARGUMENTS:
        raise ValueError(
            f'request must be one of {", ".join(REQUEST_ARGUMENTS)}; got {short_repr(name)}'
        )
    types = {NAME_ARGUMENT: STRING, DEADLINE_ARGUMENT: DOUBLE, **REQUEST_ARGUMENTS[name]}
    if strange := [key for key in arguments if key not in types]:
        known = ', '.join(REQUEST_ARGUMENTS[name]) or 'no arguments'
        raise ValueError(f'{name} takes {known}; got {short_repr(strange[0])}')
    given = {NAME_ARGUMENT: name, **arguments}
    return SetParametersAtomically.Request(
        parameters=[build_parameter(key, types[key].number, value) for key, value in given.items()]
    )


def check_content(level: Any) -> int:
    """Return a content to write.

    Raises:
        ValueError: It is not a whole number from 0.
    """
    if _is_instance(Integral, level) and level >= 0:
        return int(level)
    raise _build_field_error('level', 'a whole number of at least 0', level)


_TYPE_NAMES: dict[str, tuple[type, str]] = {
    'boolean': (bool, 'true or false'),
    'string': (str, 'a text'),
    'double': (Real, 'a number'),
}
"""What the fields take that are no whole numbers, by type."""


def convert_field(name: str, kind: str, value: Any) -> Any:
    """Return a value as a field takes it.

    Args:
        name: Of the value, for the error.
        kind: Type of the field, as its message calls it, such as `uint16` or `sequence<double>`.
        value: Any value; numbers of NumPy are converted.

    Raises:
        ValueError: The field cannot hold it.
    """
    if kind.startswith('sequence<'):
        if isinstance(value, Sequence) and not isinstance(value, str):
            return [convert_field(name, kind[len('sequence<') : -1], item) for item in value]
        raise _build_field_error(name, 'a list', value)
    if 'int' in kind:
        bits, signed = int(kind[kind.index('int') + 3 :]), not kind.startswith('u')
        low, high = (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) if signed else (0, 2**bits - 1)
        if _is_instance(Integral, value) and low <= value <= high:
            return int(value)
        raise _build_field_error(name, f'a whole number from {low} to {high}', value)
    wanted, words = _TYPE_NAMES[kind]
    if not _is_instance(wanted, value):
        raise _build_field_error(name, words, value)
    if wanted is str and '\0' in value:  # messages end a text there
        raise _build_field_error(name, 'a text without NUL', value)
    try:
        return float(value) if wanted is Real else value
    except OverflowError:
        raise _build_field_error(name, words, value) from None


def build_parameter(name: str, number: int, value: Any) -> Any:
    """Return a rcl_interfaces/msg/Parameter; the number is that of its type in ParameterType.

    Raises:
        ValueError: It is not of this type.
    """
    from rcl_interfaces.msg import Parameter, ParameterValue

    field, kind = list(ParameterValue.get_fields_and_field_types().items())[number]
    given = Parameter(name=name)
    given.value.type = number
    setattr(given.value, field, convert_field(name, kind, value))
    return given


def _is_instance(wanted: type, value: Any) -> bool:
    return isinstance(value, wanted) and (wanted is bool or not isinstance(value, bool))


def _build_field_error(name: str, wanted: str, value: Any) -> ValueError:
    return ValueError(f'{name} must be {wanted}; got {short_repr(value)}')


# --- why there is none ------------------------------------------------------------------------


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


# --- answers ----------------------------------------------------------------------------------


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
    repeated = {'asked': goal.level} if hasattr(goal, 'level') else {}
    return decode_answer(kind, not result.error_code, {**extract_values(name, result), **repeated})


def extract_values(name: str, result: Any) -> Mapping[str, Any]:
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


# --- topics -----------------------------------------------------------------------------------


def parse_content(values: Mapping[str, Any]) -> int:
    """Return the content that an outcome tells: a word, or a level.

    Raises:
        KeyError: It tells none.
        ValueError: It is no number.
    """
    return int(values['word'] if 'word' in values else values['level'])


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
