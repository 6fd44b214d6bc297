# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A bad request to the running node: one clear message, counted, and nothing is changed."""

import math
from contextlib import contextmanager

import pytest
from robot import values
from sensor_msgs.msg import JointState

LEVEL = 2
FAR = JointState(name=['substrate'], position=[0.35])  # metres


@pytest.fixture(scope='module')
def written(robot):
    """A robot whose element holds a level and has come to rest."""
    robot.received('level'), robot.received('outcome'), robot.received('/diagnostics')
    assert robot.write(LEVEL)['level'] == LEVEL
    robot.latest('level', lambda level: level.data == LEVEL)
    robot.latest('outcome', lambda status: values(status).get('level') == str(LEVEL))
    return robot


def warnings(output):
    """Return the refusals; on a loaded machine there are warnings of lost ticks, too."""
    lines = output.splitlines()
    return [line for line in lines if line.startswith('[WARN]') and 'refused' in line]


@contextmanager
def unchanged(robot):
    """Assert that a block changes neither parameters nor content nor strain."""

    def look():
        return {
            'parameters': robot.get_all(),
            'field': robot.next('field').data,
            'wall': robot.next('wall').data,
            'strain': robot.next('joint_states').position[0],
            'levels': [level.data for level in robot.received('level')],
            'outcomes': len(robot.received('outcome')),
        }

    before = look()
    yield
    after = look()
    # It may still ring after the write, by far less than the step of 1 between the phases
    # that a cell would make if the wall moved.
    for name in ('field', 'wall'):
        assert after.pop(name) == pytest.approx(before.pop(name), abs=0.05), name
    assert after == before


BAD_MESSAGES = [
    ('strain', lambda robot: robot.publish('strain', data=math.nan), 'nan'),
    ('strain', lambda robot: robot.publish('strain', data=0.1501), '0.1501'),
    ('write_level', lambda robot: robot.publish('write_level', data=8), 'level'),
    ('strain_trajectory', lambda robot: robot.follow(), 'points'),
    ('strain_trajectory', lambda robot: robot.follow((10, 0.01), (10, 0.02)), 'rising'),
    ('strain_trajectory', lambda robot: robot.follow((10, 0.1), (20, math.nan)), 'finite'),
    ('strain_trajectory', lambda robot: robot.follow((10, 0), (20, 0.1501)), 'max_strain'),
    ('strain_trajectory', lambda robot: robot.follow((1, 0.02)), 'hand_rate'),
    ('joint_commands', lambda robot: robot.send_message('joint_commands', FAR), '2.25 m'),
]


def test_bad_message_is_rejected_in_one_line(memory, written):
    counted = written.count_refused()
    with unchanged(written):
        for topic, send, word in BAD_MESSAGES:
            before = len(memory.output)
            send(written)
            written.wait(lambda before=before: warnings(memory.output[before:]), 'a message')
            written.get('target_level')  # when it is answered, all lines have been written
            (line,) = warnings(memory.output[before:])
            assert f'/{topic} refused' in line
            assert word in line
    assert written.count_refused() == counted + len(BAD_MESSAGES)
