# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a component says of itself, and warnings that stay until they have been seen."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus

from ....device import Loop, MemoryElement

OK, WARN, ERROR = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR

HOLD = 5
"""Reports for which a warning stays after its cause has gone."""


@dataclass(frozen=True)
class Health:
    """How a component is.

    Attributes:
        level: OK, WARN or ERROR of diagnostic_msgs/msg/DiagnosticStatus; that a status is stale is
            for the aggregator to say, which no longer hears of it.
        text: In a few words.
        values: By name; numbers, texts and truth values.
    """

    level: bytes
    text: str
    values: dict[str, Any] = field(default_factory=dict)


class Component:
    """A part of the device with a status of its own.

    Attributes:
        name: As it is told on /diagnostics, behind the node's name.
    """

    name: str

    def before_tick(self, element: MemoryElement) -> None:
        """Look at the device in the loop's thread, one tick before `after_tick`."""

    def after_tick(self, element: MemoryElement) -> None:
        """Look at the device in the loop's thread, where its state is whole; once a report."""

    def health(self, loop: Loop) -> Health:
        """Return how it is, in the executor's thread, while the node is active."""
        raise NotImplementedError

    def rest(self) -> Health:
        """Return how it is while the node is not active."""
        return Health(OK, 'inactive')


class Hysteresis:
    """Lets a warning stay for some reports, so that it is seen and does not flicker."""

    def __init__(self, hold: int = HOLD) -> None:
        self._hold = hold
        self._held: Health | None = None
        self._calm = 0

    def forget(self) -> None:
        """Hold no warning any more: the node is not active."""
        self._held = None

    def smooth(self, now: Health) -> Health:
        """Return the present health, or the present values under the warning that stays."""
        if now.level == OK or (self._held and now.level < self._held.level):
            self._calm += 1
        else:
            self._held, self._calm = now, 0
        if self._calm > self._hold:
            self._held = None
        if self._held is None:
            return now
        return dataclasses.replace(now, level=self._held.level, text=self._held.text)
