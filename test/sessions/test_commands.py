# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Commands as values: they survive a session file unchanged."""

import json

import pytest

from mlmem import (
    Abort,
    Calibrate,
    Disturb,
    Erase,
    Faults,
    FollowTrajectory,
    Kick,
    Locate,
    Read,
    Reset,
    SelfTest,
    SetFaults,
    SetMethod,
    SetStrain,
    Survey,
    Write,
)
from mlmem.commands import COMMANDS_BY_NAME
from mlmem.parsing import DecodeError
from mlmem_ros.bag import jazzy
from mlmem_ros.session.records import build_command, command_to_dict, read_command

COMMANDS = [
    SetStrain(0.1 + 0.2), SetStrain(-5e-324), FollowTrajectory((0.1, 0.3), (0.01, 0.0)),
    FollowTrajectory((0.1,), (0.1 + 0.2,), (-5e-324,), 'substrate'),
    Write(7), Read(), Read('right'), Erase(), Calibrate(), SelfTest(), Locate(), Reset(), Reset(2),
    Survey(), Kick(0.1 + 0.2),
    Abort(), Abort('the device is shut down'),
    SetMethod('kick'), Disturb(1.0 / 3.0), SetFaults(Faults()),
    SetFaults(Faults(sensor_noise=0.1, weak_cell=7)),
]  # fmt: skip


@pytest.mark.parametrize('command', COMMANDS, ids=str)
def test_command_survives_a_file_to_the_bit(command):
    cdr = build_command(7, command)
    text = jazzy.deserialize_message(cdr, 'std_msgs/msg/String').data
    assert read_command(text) == (7, command)


def test_every_command_is_tested_and_has_a_kind():
    assert {type(command) for command in COMMANDS} == set(COMMANDS_BY_NAME.values())
    assert command_to_dict(Write(3)) == {'kind': 'Write', 'level': 3}


@pytest.mark.parametrize(
    ('data', 'field'),
    [
        ({}, 'kind'),
        ({'kind': 'write', 'level': 1}, 'kind'),
        ({'kind': ['Write']}, 'kind'),
        ({'kind': 'Write', 'level': 1, 'end': 'left'}, 'end'),
        ({'kind': 'Erase', 'level': 1}, 'level'),
        ({'kind': 'SetFaults', 'faults': {'weak_cell': -1}}, 'faults.weak_cell'),
    ],
    ids=str,
)
def test_data_that_are_no_command_are_rejected(data, field):
    """What else is none is in test_outside.py."""
    with pytest.raises(DecodeError) as caught:
        read_command(json.dumps({'tick': 0, **data}))
    assert caught.value.field == field
