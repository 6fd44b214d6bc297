# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Constants that the device, the messages and the clients share, without importing the device."""

from __future__ import annotations

BLANK = -1
"""Level of an element without a wall."""

UNDECODABLE = -2
"""Level reported when the reading is not clear."""

JOINT = 'substrate'
"""The one joint of an element, as named in `~/joint_states`."""


def describe_level(level: int) -> str:
    """Return a level in words."""
    if level >= 0:
        return f'level {level}'
    return 'blank' if level == BLANK else 'undecodable'
