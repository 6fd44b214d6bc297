# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A memory node's answers as typed values: the client's side of `outcomes`."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, TypeVar

from ..outside import DecodeError, decode, from_json
from ..words import BLANK
from . import received
from .errors import RequestFailed, RequestRefused

SomeAnswer = TypeVar('SomeAnswer', bound='Answer')


@dataclass(frozen=True)
class Answer:
    """The answer to a request that succeeded.

    Attributes:
        details: The node's whole answer, by the names in its JSON object.
    """

    details: Mapping[str, Any] = field(repr=False, compare=False)


@dataclass(frozen=True)
class Done(Answer):
    """A procedure that succeeded.

    Attributes:
        attempts: Attempts it took.
        ticks: Ticks of the device it took.
    """

    attempts: int
    ticks: int


@dataclass(frozen=True)
class Decoded(Done):
    """The answer of write, read and erase: the content as decoded from its echo.

    Attributes:
        level: 0 ... p - 1, or -1 if the element is blank.
        code: Binary code of the level; empty if blank.
        end: The probed end: left or right.
        delay: Echo delay in time units, or None without an echo.
        level_margin: 1 on the calibrated delay, 0 half-way to the next level.
        threshold_margin: Greatest v_c over the threshold; above 1 for an echo.
        confidence: From 0 to 1: the lesser of the level margin and 1 - 1 / threshold margin.
    """

    level: int
    code: str
    end: str
    delay: float | None
    level_margin: float
    threshold_margin: float
    confidence: float

    @property
    def blank(self) -> bool:
        """Whether the element holds no level."""
        return self.level == BLANK


@dataclass(frozen=True)
class Calibrated(Decoded):
    """The answer of calibrate: the restored content and the measured delays.

    Attributes:
        delays: Echo delay of every level in time units, by the end that receives it.
    """

    delays: Mapping[str, tuple[float, ...]]


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
    """Whether time is paused.

    Attributes:
        paused: True while it is.
        tick: Ticks the device has done.
    """

    paused: bool
    tick: int


@dataclass(frozen=True)
class Recorded(Answer):
    """Whether a session is recorded.

    Attributes:
        recording: True while it is.
        path: Its bag, on the node's machine.
    """

    recording: bool
    path: str


@dataclass(frozen=True)
class Stepped(Answer):
    """A single tick that was run.

    Attributes:
        tick: Ticks the device has done.
    """

    tick: int


ANSWERS: dict[str, type[Answer]] = {
    'calibrate': Calibrated,
    'self_test': SelfTested,
    'abort': Done,
}
"""Types of successful answers by procedure; those of all others are `Decoded`."""


def parse(kind: type[SomeAnswer], success: bool, message: str) -> SomeAnswer:
    """Return a service's answer, one JSON object, as a value of the type that a success has.

    Raises:
        RequestRefused: The node refused the request.
        RequestFailed: It failed, or its answer is malformed.
    """
    try:
        return understood(kind, success, decode(dict[str, Any], from_json(message), 'the answer'))
    except DecodeError as error:
        raise RequestFailed({'error': str(error)}) from None


def understood(kind: type[SomeAnswer], success: bool, said: Mapping[str, Any]) -> SomeAnswer:
    """Return a node's answer, given as values by name; raises as `parse` does."""
    if not success:
        raise (RequestFailed if 'procedure' in said else RequestRefused)(said)
    known = (each.name for each in dataclasses.fields(kind))
    values = {name: said[name] for name in known if name in said}
    try:
        answer: SomeAnswer = decode(kind, {**values, 'details': said}, 'the answer')
    except DecodeError as error:
        raise RequestFailed({**said, 'error': str(error)}) from None
    return answer


def parse_self_test(response: Any) -> SelfTested:
    """Return the answer in a diagnostic_msgs/SelfTest response.

    Raises:
        RequestRefused: The test did not run.
    """
    found = {status.name.rpartition(': ')[2]: status for status in response.status}
    if 'self_test' in found:
        raise RequestRefused({'error': found['self_test'].message})
    values = {name: received.values(status) for name, status in found.items()}
    return SelfTested(
        MappingProxyType(values),
        passed=response.passed not in (False, b'\0'),
        checks=MappingProxyType({name: status.message for name, status in found.items()}),
        failed=tuple(name for name, status in found.items() if status.level != b'\0'),
    )
