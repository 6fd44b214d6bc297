# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Replay of other recorders' bags, of damaged ones and of bags without a session."""

from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from mlmem import MemoryElement
from mlmem.instrument.instrument import Units
from mlmem.physics import CASE_II
from mlmem_ros.bag.errors import BagError
from mlmem_ros.bag.mcap_part import RECORD_BYTES
from mlmem_ros.session import data
from mlmem_ros.session.data import load_session
from mlmem_ros.session.replay import replay_commands, run_replay
from mlmem_tools.cli.main import main

from .tampering import Tampered

DATA = Path(__file__).parent.parent / 'data'
JAZZY = get_typestore(Stores.ROS2_JAZZY)


def foreign_bag(path, messages, node='/mlmem'):
    """Write command messages as another recorder would: (seconds, topic, type, values)."""
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connections = {}
        for seconds, topic, kind, values in messages:
            if topic not in connections:
                name = f'{node}/{topic}'
                connections[topic] = writer.add_connection(name, kind, typestore=JAZZY)
            message = JAZZY.types[kind](**values)
            data = JAZZY.serialize_cdr(message, kind)
            writer.write(connections[topic], round(1e9 * (1000 + seconds)), data)
    return path


WRITE_LEVEL_1_THEN_PROBE = [
    (0.0, 'write_level', 'std_msgs/msg/UInt8', {'data': 1}),
    # Launch and one cycle take 9000 time units, 0.9 s at 1e-4 s each, and the verifying echo.
    (1.5, 'probe', 'std_msgs/msg/Empty', {'structure_needs_at_least_one_member': 0}),
]


def test_commands_of_other_recorders_apply_at_their_stamps(tmp_path):
    session = load_session(foreign_bag(tmp_path / 'bag', WRITE_LEVEL_1_THEN_PROBE))
    report = replay_commands(MemoryElement(CASE_II), session)
    assert report.refused == []
    assert [(o.procedure, o.reading.level) for o in report.outcomes] == [('write', 1), ('read', 1)]
    probed = report.outcomes[1].start_tick
    assert probed == round(1.5 / 2e-3)  # ticks of 20 time units, 2 ms


def test_bag_of_another_recorder_is_read_by_time(tmp_path):
    orders = [(0.5 * n, 'write_level', 'std_msgs/msg/UInt8', {'data': n}) for n in (3, 0, 2, 1)]
    session = load_session(foreign_bag(tmp_path / 'bag', orders))
    assert [(time, given.level) for time, given in session.commands] == [
        (0.5 * n, n) for n in range(4)
    ]


def test_foreign_bag_that_takes_too_much_memory_is_rejected(tmp_path, monkeypatch):
    monkeypatch.setattr(data, 'MAX_SESSION_BYTES', 10 * RECORD_BYTES)
    bag = foreign_bag(tmp_path / 'bag', 10 * WRITE_LEVEL_1_THEN_PROBE)
    with pytest.raises(BagError) as caught:
        load_session(bag)
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


def test_command_while_busy_is_rejected_in_a_replay(tmp_path):
    early = [WRITE_LEVEL_1_THEN_PROBE[0], (0.1, *WRITE_LEVEL_1_THEN_PROBE[1][1:])]
    report = replay_commands(
        MemoryElement(CASE_II), load_session(foreign_bag(tmp_path / 'bag', early))
    )
    assert len(report.refused) == 1
    assert 'busy: write is running' in report.refused[0]
    assert report.levels[-1] == 1


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


def test_imu_of_a_robots_bag_shakes_the_base(tmp_path):
    """An IMU at 100 Hz: at 1 cm and (0.1 ms)^2 a hundred m/s^2 are 1e-4 of the unit."""
    kind = 'sensor_msgs/msg/Imu'
    told = [(0.01 * n, 'disturbance', kind, imu(100.0 * (-1) ** n)) for n in range(10)]
    told.append((0.1, 'disturbance', kind, imu(0.0, covariance=-1.0)))  # no accelerometer
    session = load_session(foreign_bag(tmp_path / 'bag', told))
    assert [command.acceleration for _, command in session.commands[:2]] == pytest.approx(
        [1e-4, -1e-4]
    )
    element = MemoryElement(CASE_II)
    report = replay_commands(element, session)
    (refusal,) = report.refused
    assert 'acceleration must be a finite number' in refusal
    assert element.base.state.acceleration == pytest.approx(-1e-4)


def test_replay_exit_status_is_the_verdict(tmp_path, capsys):
    foreign = foreign_bag(tmp_path / 'bag', WRITE_LEVEL_1_THEN_PROBE)
    assert main(['replay', str(foreign)]) == 1  # with nothing to compare
    assert main(['replay', str(DATA / 'life')]) == 0
    assert 'exact' in capsys.readouterr().out
    assert main(['replay', str(tmp_path / 'nothing')]) == 2
    assert 'nothing' in capsys.readouterr().err


def test_bag_without_our_topics_is_rejected(tmp_path):
    chatter = [(0.0, 'chatter', 'std_msgs/msg/String', {'data': 'hello'})]
    with pytest.raises(BagError, match=r'/talker/chatter'):
        load_session(foreign_bag(tmp_path / 'bag', chatter, node='/talker'))


def test_bag_of_several_nodes_needs_a_name(tmp_path):
    kind = 'std_msgs/msg/UInt8'
    with Writer(tmp_path / 'bag', version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        for node in ('/a', '/b'):
            connection = writer.add_connection(f'{node}/write_level', kind, typestore=JAZZY)
            data = JAZZY.serialize_cdr(JAZZY.types[kind](data=3), kind)
            writer.write(connection, 10**12, data)
    with pytest.raises(BagError, match="'/a', '/b'"):
        load_session(tmp_path / 'bag')
    assert len(load_session(tmp_path / 'bag', '/b').commands) == 1


def trajectory(*points, joint='substrate'):
    """Return the values of a JointTrajectory of points (seconds, positions, velocities)."""
    point, duration = (
        JAZZY.types[name]
        for name in ('trajectory_msgs/msg/JointTrajectoryPoint', 'builtin_interfaces/msg/Duration')
    )
    time = JAZZY.types['builtin_interfaces/msg/Time'](0, 0)
    return {
        'header': JAZZY.types['std_msgs/msg/Header'](time, ''),
        'joint_names': [joint],
        'points': [
            point(
                np.array(positions, dtype=float),
                np.array(velocities, dtype=float),
                np.array([]),
                np.array([]),
                duration(int(seconds), round(1e9 * (seconds % 1.0))),
            )
            for seconds, positions, velocities in points
        ],
    }


def test_trajectory_by_hand_is_replayed(tmp_path):
    length = Units().elongation
    points = ((0.02, [0.02 * length], []), (0.06, [-0.01 * length], []))
    kind = 'trajectory_msgs/msg/JointTrajectory'
    drive = [(0.0, 'strain_trajectory', kind, trajectory(*points))]
    element = MemoryElement(CASE_II)
    report = replay_commands(element, load_session(foreign_bag(tmp_path / 'bag', drive)))
    assert report.refused == []
    for _ in range(9):  # one tick of 2 ms is done
        element.advance()
    assert element.actuator.strain == pytest.approx(0.02, abs=1e-15)
    for _ in range(20):
        element.advance()
    assert element.actuator.strain == pytest.approx(-0.01, abs=1e-15)


@pytest.mark.parametrize(
    ('points', 'word'),
    [
        ([(0.1, [0.01, 0.02], []), (0.2, [], [])], 'one position; got 2 in point 1'),
        ([(0.1, [0.01], []), (0.2, [], [])], 'one position; got 0 in point 2'),
        ([(0.1, [0.01], [0.0, 0.0]), (0.2, [0.0], [])], 'one velocity; got 2 in point 1'),
        ([(0.1, [0.01], [0.0]), (0.2, [0.0], [])], 'one velocity; got 0 in point 2'),
    ],
)
def test_trajectory_point_without_one_position_is_rejected(tmp_path, points, word):
    """Two positions in one point and none in the next are refused."""
    kind = 'trajectory_msgs/msg/JointTrajectory'
    bag = foreign_bag(
        tmp_path / 'bag',
        [
            (0.0, 'strain_trajectory', kind, trajectory(*points)),
            (0.1, 'strain', 'std_msgs/msg/Float64', {'data': 0.01}),
        ],
    )
    report = replay_commands(MemoryElement(CASE_II), load_session(bag))
    (refusal,) = report.refused
    assert word in refusal
    assert report.commands == 1


def test_texts_from_a_bag_are_not_markup(tmp_path, capsys):
    """Names that rich would read as styles or an emoji, or that clear the terminal."""
    node = '/[/red]:smile:\x1b[2J'
    drive = [(0.0, 'strain', 'std_msgs/msg/Float64', {'data': 0.02})]
    assert main(['inspect', str(foreign_bag(tmp_path / 'bag', drive, node=node))]) == 0
    told = capsys.readouterr().out
    assert '/[/red]:smile:\\x1b[2J' in told
    assert '\x1b' not in told
