# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A bad request to the running node: one clear message, counted, and nothing is changed."""

import math

import pytest
from rclpy.parameter import Parameter
from robot import values

from mlmem import preset

LIMIT = preset('case_2').settings.actuator.max_strain
LEVEL = 2
INTEGER = Parameter.Type.INTEGER


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


class Unchanged:
    """Asserts that a block changes neither parameters nor content nor strain."""

    def __init__(self, robot):
        self.robot = robot

    def take(self):
        robot = self.robot
        return {
            'parameters': robot.parameters(),
            'field': robot.next('field').data,
            'wall': robot.next('wall').data,
            'strain': robot.next('joint_states').position[0],
            'levels': [level.data for level in robot.received('level')],
            'outcomes': len(robot.received('outcome')),
        }

    def __enter__(self):
        self.before = self.take()

    def __exit__(self, kind, *_):
        if kind is not None:
            return
        after = self.take()
        # It may still ring after the write, by far less than the step of 1 between the phases
        # that a cell would make if the wall moved.
        for what in ('field', 'wall'):
            assert after.pop(what) == pytest.approx(self.before.pop(what), abs=0.05), what
        assert after == self.before


@pytest.mark.parametrize(
    ('topic', 'sent', 'words'),
    [
        ('strain', [math.nan], ['strain', f'from -{LIMIT} to {LIMIT}', 'got nan']),
        ('strain', [0.1501], ['strain', f'from -{LIMIT} to {LIMIT}', 'got 0.1501']),
        ('write_level', [8], ['level', 'from 0 to 7; got 8']),
        ('strain_trajectory', [], ['1 to 10000 points', 'got 0']),
        ('strain_trajectory', [(10, 0.01), (10, 0.02)], ['rising']),
        ('strain_trajectory', [(10, 0.01), (20, math.nan)], ['finite', 'got nan']),
        ('strain_trajectory', [(10, 0.01), (20, 0.1501)], ['max_strain', 'reaches 0.1501']),
        ('strain_trajectory', [(1, 0.02)], ['hand_rate', '5e-05']),
    ],
    ids=str,
)
def test_bad_message_is_rejected_in_one_line(memory, written, topic, sent, words):
    before = len(memory.output)
    with Unchanged(written):
        if topic == 'strain_trajectory':
            written.follow(*sent)
        else:
            written.publish(topic, *sent)
        written.wait(lambda: warnings(memory.output[before:]), 'a message')
    (line,) = warnings(memory.output[before:])
    for word in [f'/{topic}', *words]:
        assert word in line


@pytest.mark.parametrize(
    ('name', 'value', 'words'),
    [
        ('target_level', 8, ['target_level', 'range']),
        ('target_level', -2, ['target_level', 'range']),
        ('target_level', 'five', [str(INTEGER), str(Parameter.Type.STRING)]),  # rclpy's words
        ('no.such_parameter', 1, ['undeclared']),
    ],
    ids=str,
)
def test_bad_parameter_is_rejected_with_the_reason(written, name, value, words):
    with Unchanged(written):
        result = written.try_set(name, value)
    assert not result.successful
    for word in words:
        assert word in result.reason


def refused_until_now(robot):
    """Return the count of refused requests from a report made after this call."""
    robot.next('/diagnostics')  # made before the call, perhaps
    statuses = robot.next('/diagnostics').status
    return next(int(found['refused']) for s in statuses if 'refused' in (found := values(s)))


def test_bad_requests_are_counted_in_diagnostics(written):
    before = refused_until_now(written)
    written.publish('strain', math.nan)
    written.publish('strain', 1.0)
    written.publish('write_level', 9)
    assert not written.trigger('step').success  # time runs
    assert refused_until_now(written) == before + 4
