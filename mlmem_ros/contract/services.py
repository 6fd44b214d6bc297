# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The services of a memory node: names, types and meanings."""

from __future__ import annotations

from typing import NamedTuple


class Service(NamedTuple):
    """A service.

    Attributes:
        name: Below the node's name.
        type: Its type.
        meaning: What it does, for the reference page.
    """

    name: str
    type: str
    meaning: str


TRIGGER = 'std_srvs/srv/Trigger'
SET_BOOL = 'std_srvs/srv/SetBool'

SERVICES = (
    Service('write', TRIGGER, 'write the level in `target_level` and verify it by an echo'),
    Service('read', TRIGGER, 'fire a probe pulse and decode its echo'),
    Service('erase', TRIGGER, 'make the element blank'),
    Service('calibrate', TRIGGER, 'learn the echo delay of every level, then restore the content'),
    Service(
        'self_test',
        'diagnostic_msgs/srv/SelfTest',
        'test transducers, actuator, erase and every level from both ends, then restore the '
        'content; one status for each',
    ),
    Service(
        'request',
        'rcl_interfaces/srv/SetParametersAtomically',
        'a procedure with its arguments, as parameters that hold for this request alone; the '
        'answer is the JSON object in `reason`',
    ),
    Service('abort', TRIGGER, 'stop the running procedure and bring the strain to zero'),
    Service(
        'pause',
        SET_BOOL,
        'hold or resume time; commands given while time is held take effect with the next tick',
    ),
    Service('step', TRIGGER, 'run one tick while time is held'),
    Service(
        'record',
        SET_BOOL,
        'start or stop recording a session to `record.path`; if that exists or is empty, the '
        'name gets the time',
    ),
)
"""All of them. Procedures answer when they have ended, with one JSON object."""
