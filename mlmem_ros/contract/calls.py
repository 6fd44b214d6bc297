# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a client makes of what comes back: errors, answers, and messages, live or from a bag."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from mlmem.parsing import DecodeError, decode_value, parse_json
from mlmem.procedure_table import JOINT_NAME
from mlmem.schema import short_repr

from .answers import Answer, SelfTested, list_all_fields, wire_fields
from .topics import OK, parse_status

SomeAnswer = TypeVar('SomeAnswer', bound=Answer)


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
