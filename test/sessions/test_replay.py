# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which bags hold a session, and how messages become the commands that a replay runs again."""

import math
from pathlib import Path

import numpy as np
import pytest
from rosbags.typesys import Stores, get_typestore

from mlmem import Refused
from mlmem.instrument.instrument import Units
from mlmem_ros.bag.errors import BagError
from mlmem_ros.contract.commands import parse_acceleration, parse_trajectory
from mlmem_ros.session import data
from mlmem_ros.session.data import load_session
from mlmem_ros.session.replay import run_replay
from mlmem_tools.cli.main import main

from .tampering import Tampered

DATA = Path(__file__).parent.parent / 'data'
JAZZY = get_typestore(Stores.ROS2_JAZZY)


def renamed(session, node):
    """Return a copy of a session of /mlmem as one of another node."""

    def rename(topic):
        return node + topic.removeprefix('/mlmem')

    return Tampered(
        {
            rename(name): type(info)(rename(name), info.type)
            for name, info in session.topics.items()
        },
        {rename(name): definition for name, definition in session.definitions.items()},
        [each._replace(topic=rename(each.topic)) for each in session.messages],
    )


def test_session_that_takes_too_much_memory_is_rejected(monkeypatch):
    monkeypatch.setattr(data, 'MAX_SESSION_BYTES', 10_000)
    with pytest.raises(BagError) as caught:
        load_session(DATA / 'life')
    assert caught.value.code == 'too_large'


def test_session_with_a_clock_set_back_is_exact(tmp_path):
    """As NTP steps a clock, half an hour back in the middle of a session."""
    whole = Tampered.read(DATA / 'life')
    middle = len(whole.messages) // 2
    whole.messages[middle:] = [
        message._replace(log_time=message.log_time - 1800 * 10**9)
        for message in whole.messages[middle:]
    ]
    whole.write(tmp_path / 'stepped')
    session = load_session(tmp_path / 'stepped')
    assert run_replay(session).exact
    times = [time for time, _ in session.outcomes]
    assert times == sorted(times)
    assert times[-1] < 60.0
    whole.messages.sort(key=lambda message: message.log_time)
    whole.write(tmp_path / 'sorted')
    with pytest.raises(BagError, match='a copy sorted by time cannot be replayed'):
        run_replay(load_session(tmp_path / 'sorted'))


def test_bag_without_a_session_is_rejected(tmp_path):
    made = renamed(Tampered.read(DATA / 'life'), '/talker')
    made.messages = [each for each in made.messages if each.topic == '/talker/level']
    made.topics = {'/talker/level': made.topics['/talker/level']}
    made.write(tmp_path / 'bag')
    with pytest.raises(BagError, match=r'must hold a session .*/talker/level'):
        load_session(tmp_path / 'bag')


def test_bag_of_several_nodes_needs_a_name(tmp_path):
    life = Tampered.read(DATA / 'life')
    both, other = renamed(life, '/a'), renamed(life, '/b')
    both.topics |= other.topics
    both.definitions |= other.definitions
    both.messages += other.messages
    both.write(tmp_path / 'bag')
    with pytest.raises(BagError, match="'/a', '/b'"):
        load_session(tmp_path / 'bag')
    assert run_replay(load_session(tmp_path / 'bag', '/b')).passed


def test_texts_from_a_bag_are_not_markup(tmp_path, capsys):
    """Names that rich would read as styles or an emoji, or that clear the terminal."""
    renamed(Tampered.read(DATA / 'life'), '/[/red]:smile:\x1b[2J').write(tmp_path / 'bag')
    assert main(['inspect', str(tmp_path / 'bag')]) == 0
    told = capsys.readouterr().out
    assert '/[/red]:smile:\\x1b[2J' in told
    assert '\x1b' not in told


def imu(acceleration, covariance=0.0):
    """Return the values of an Imu message that tells an acceleration along the chain."""
    vector, quaternion = JAZZY.types['geometry_msgs/msg/Vector3'], 'geometry_msgs/msg/Quaternion'
    time = JAZZY.types['builtin_interfaces/msg/Time'](0, 0)
    return {
        'header': JAZZY.types['std_msgs/msg/Header'](time, 'base_link'),
        'orientation': JAZZY.types[quaternion](0.0, 0.0, 0.0, 1.0),
        'orientation_covariance': np.zeros(9),
        'angular_velocity': vector(0.0, 0.0, 0.0),
        'angular_velocity_covariance': np.zeros(9),
        'linear_acceleration': vector(acceleration, 0.0, 9.81),
        'linear_acceleration_covariance': np.array([covariance] + [0.0] * 8),
    }


def test_imu_gives_the_acceleration_of_the_base():
    """At 1 cm and (0.1 ms)^2 a hundred m/s^2 are 1e-4 of the unit."""
    message = JAZZY.types['sensor_msgs/msg/Imu']
    assert parse_acceleration(message(**imu(100.0)), Units()).acceleration == pytest.approx(1e-4)
    without_accelerometer = parse_acceleration(message(**imu(0.0, covariance=-1.0)), Units())
    assert math.isnan(without_accelerometer.acceleration)


TRAJECTORY = 'trajectory_msgs/msg/JointTrajectory'


def message(name, **values):
    """Return a message of a type such as `Time`, of builtin_interfaces by default."""
    return JAZZY.types[name if '/' in name else f'builtin_interfaces/msg/{name}'](**values)


def trajectory(*points):
    """Return a JointTrajectory of points (seconds, positions, velocities)."""
    header = message('std_msgs/msg/Header', stamp=message('Time', sec=0, nanosec=0), frame_id='')
    found = [
        message(
            f'{TRAJECTORY}Point',
            positions=np.array(positions, dtype=float),
            velocities=np.array(velocities, dtype=float),
            accelerations=np.array([]),
            effort=np.array([]),
            time_from_start=message(
                'Duration', sec=int(seconds), nanosec=round(1e9 * (seconds % 1.0))
            ),
        )
        for seconds, positions, velocities in points
    ]
    return message(TRAJECTORY, header=header, joint_names=['substrate'], points=found)


def test_trajectory_is_converted_to_strains():
    length = Units().elongation
    points = ((0.02, [0.02 * length], []), (1.5, [-0.01 * length], []))
    command = parse_trajectory(trajectory(*points), Units())
    assert command.times == pytest.approx((0.02, 1.5))
    assert command.strains == pytest.approx((0.02, -0.01))
    assert (command.rates, command.joint) == ((), 'substrate')


@pytest.mark.parametrize(
    ('points', 'word'),
    [
        ([(0.1, [0.01, 0.02], []), (0.2, [0.0], [])], 'one position'),
        ([(0.1, [0.01], []), (0.2, [], [])], 'one position'),
        ([(0.1, [0.01], [0.0, 0.0]), (0.2, [0.0], [])], 'one velocity'),
        ([(0.1, [0.01], [0.0]), (0.2, [0.0], [])], 'one velocity'),
    ],
    ids=str,
)
def test_trajectory_point_without_one_position_is_rejected(points, word):
    with pytest.raises(Refused, match=word):
        parse_trajectory(trajectory(*points), Units())
