# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a DiagnosticStatus says, apart from the element: a client needs it without the physics."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

OK, WARN, ERROR = range(3)
"""Levels of diagnostic_msgs/msg/DiagnosticStatus."""


class Status(NamedTuple):
    """The values of a DiagnosticStatus.

    Attributes:
        severity: `OK`, `WARN` or `ERROR`.
        text: In words.
        values: Values as texts, by key.
    """

    severity: int
    text: str
    values: Mapping[str, str]


def parse_status(message: Any) -> Status:
    """Return the values of a DiagnosticStatus, from rclpy or from a bag."""
    severity = message.level[0] if isinstance(message.level, bytes) else int(message.level)
    pairs = {pair.key: pair.value for pair in message.values}
    return Status(severity, message.message, pairs)
