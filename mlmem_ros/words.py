# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Constants that the device, the messages and clients share; they need no device."""

from __future__ import annotations

BLANK = -1
"""Level of an element with no wall."""

UNDECODABLE = -2
"""Level of an answer without a clear reading."""

JOINT = 'substrate'
"""The one joint of an element, as named in `~/joint_states`."""


def describe_level(level: int) -> str:
    """Return a level in words."""
    if level >= 0:
        return f'level {level}'
    return 'blank' if level == BLANK else 'undecodable'
