# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Requests with arguments as messages: how they are decoded, and which are refused."""

import math
from types import SimpleNamespace

import pytest
from rclpy.duration import Duration
from robot import TOPICS_IN, build_parameters
from sensor_msgs.msg import JointState
from suite import expect_rejection
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from mlmem import Abort, Erase, FollowTrajectory, Kick, Read, Refused, Write
from mlmem.physics import CASE_II
from mlmem.settings import ScaleSettings, Settings
from mlmem_ros.contract.requests import Record, build_request, parse_request

METRIC = SimpleNamespace(elongation=CASE_II.end_displacement(0.01))
"""Stands for an element whose lattice constant is 0.01 m."""


@pytest.mark.parametrize(
    ('name', 'arguments', 'command'),
    [
        ('write', {'level': 5}, Write(5)),
        ('write', {'content': 5}, Write(5)),
        ('read', {}, Read()),
        ('read', {'end': 'both'}, Read('both')),
        ('erase', {}, Erase()),
        ('abort', {}, Abort()),
        ('kick', {'speed': 1}, Kick(1.0)),
        ('follow', {'times': [1.0], 'strains': [0.1]}, FollowTrajectory((1.0,), (0.1,))),
        ('record', {'on': True, 'path': 'session'}, Record(True, 'session')),
        ('record', {'on': False}, Record(False)),
    ],
    ids=str,
)
def test_request_is_decoded_as_it_was_encoded(name, arguments, command):
    assert parse_request(build_request(name, **arguments).parameters) == (command, 0.0)


@pytest.mark.parametrize(
    'values', [{}, {'name': ['elbow'], 'position': [0.1]}, {'name': ['substrate']}], ids=str
)
def test_joint_command_without_a_position_is_rejected(values):
    with pytest.raises(Refused, match='position'):
        TOPICS_IN['joint_commands'].parse(JointState(**values), METRIC)


def test_imu_becomes_a_disturbance_in_element_units():
    scale = ScaleSettings(time=1e-5)
    element = SimpleNamespace(settings=Settings(scale=scale))
    message = TOPICS_IN['disturbance'].kind()
    message.linear_acceleration.x = 1e-7 * scale.acceleration
    command = TOPICS_IN['disturbance'].parse(message, element)
    assert command.acceleration == pytest.approx(1e-7)
    message.linear_acceleration_covariance[0] = -1.0  # it has no accelerometer
    assert math.isnan(TOPICS_IN['disturbance'].parse(message, element).acceleration)


def trajectory(*points):
    """Return a message of points (seconds, positions, velocities)."""
    message = JointTrajectory(joint_names=['substrate'])
    for seconds, positions, velocities in points:
        point = JointTrajectoryPoint(positions=positions, velocities=velocities)
        point.time_from_start = Duration(seconds=seconds).to_msg()
        message.points.append(point)
    return message


def test_trajectory_is_converted_to_strains():
    length = METRIC.elongation
    message = trajectory((0.02, [0.02 * length], []), (1.5, [-0.01 * length], []))
    command = TOPICS_IN['strain_trajectory'].parse(message, METRIC)
    assert command.times == pytest.approx((0.02, 1.5))
    assert command.strains == pytest.approx((0.02, -0.01))
    assert (command.rates, command.joint) == ((), 'substrate')


@pytest.mark.parametrize(
    ('field', 'points'),
    [
        ('positions', ((0.1, [0.01, 0.02], []), (0.2, [0.0], []))),
        ('positions', ((0.1, [0.01], []), (0.2, [], []))),
        ('velocities', ((0.1, [0.01], [0.0, 0.0]), (0.2, [0.0], []))),
        ('velocities', ((0.1, [0.01], [0.0]), (0.2, [0.0], []))),
    ],
    ids=str,
)
def test_trajectory_point_without_one_position_is_rejected(field, points):
    with expect_rejection(Refused, 'out_of_range', field):
        TOPICS_IN['strain_trajectory'].parse(trajectory(*points), METRIC)


@pytest.mark.parametrize(
    ('values', 'code', 'field'),
    [
        ({}, 'out_of_range', 'request'),
        ({'request': 'wipe'}, 'out_of_range', 'request'),
        ({'request': 7}, 'out_of_range', 'request'),
        ({'level': 1}, 'out_of_range', 'request'),
        ({'request': 'write'}, 'missing_field', 'content'),
        ({'request': 'write', 'level': -1, 'word': -1}, 'missing_field', 'content'),
        ({'request': 'write', 'level': 5, 'word': 5}, 'conflict', 'word'),
        ({'request': 'write', 'level': 5, 'content': 6}, 'conflict', 'content'),
        ({'request': 'write', 'level': '5'}, 'out_of_range', 'level'),
        ({'request': 'write', 'level': True}, 'out_of_range', 'level'),
        ({'request': 'write', 'level': 2, 'end': 'left'}, 'unknown_field', 'end'),
        ({'request': 'write', 'level': 2, 'deadline': -1.0}, 'out_of_range', 'deadline'),
        ({'request': 'kick'}, 'missing_field', 'speed'),
        ({'request': 'kick', 'speed': 1}, 'out_of_range', 'speed'),
        ({'request': 'erase', 'level': 2}, 'unknown_field', 'level'),
        ({'request': 'follow', 'times': [1.0]}, 'missing_field', 'strains'),
        ({'request': 'record', 'on': 1}, 'out_of_range', 'on'),
    ],
    ids=str,
)
def test_invalid_request_is_rejected(values, code, field):
    with expect_rejection(Refused, code, field):
        parse_request(build_parameters(**values))


@pytest.mark.parametrize(('held', 'other'), [('level', 'word'), ('word', 'level')])
def test_content_of_the_other_kind_is_rejected_by_name(held, other):
    for values in ({other: 2}, {held: 2, other: 2}, {'content': 2, other: 2}):
        with expect_rejection(Refused, 'unsupported', other) as caught:
            parse_request(build_parameters(request='write', **values), held)
        assert f'which holds a {held}' in str(caught.value)
    for name in (held, 'content'):
        request = build_parameters(request='write', **{name: 2})
        assert parse_request(request, held) == (Write(2), 0.0)


def test_argument_that_is_named_twice_is_rejected():
    with pytest.raises(Refused, match='a request must name every argument once'):
        parse_request([*build_parameters(request='write', level=1), *build_parameters(level=2)])
