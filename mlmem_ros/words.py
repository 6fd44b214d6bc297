# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Words that the device, the wire and its clients share; a client needs no device for them."""

from __future__ import annotations

BLANK = -1
"""Level of an element with no wall."""

UNDECODABLE = -2
"""Level of an answer that would be a guess."""

JOINT = 'substrate'
"""The one joint of an element, as `~/joint_states` names it."""


def describe_level(level: int) -> str:
    """Return a level as a person says it."""
    if level >= 0:
        return f'level {level}'
    return 'blank' if level == BLANK else 'undecodable'
