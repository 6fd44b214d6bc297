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


TRAJECTORY = 'trajectory_msgs/msg/JointTrajectory'


def message(name, **values):
    """Return a message of a type such as `Time`, of builtin_interfaces by default."""
    return JAZZY.types[name if '/' in name else f'builtin_interfaces/msg/{name}'](**values)


def trajectory(*points):
    """Return the values of a JointTrajectory of points (seconds, positions, velocities)."""
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
    return {'header': header, 'joint_names': ['substrate'], 'points': found}


def test_trajectory_by_hand_is_replayed(tmp_path):
    length = Units().elongation
    points = ((0.02, [0.02 * length], []), (0.06, [-0.01 * length], []))
    drive = [(0.0, 'strain_trajectory', TRAJECTORY, trajectory(*points))]
    element = MemoryElement(CASE_II)
    report = replay_commands(element, load_session(foreign_bag(tmp_path / 'bag', drive)))
    assert report.refused == []
    for ticks, strain in ((9, 0.02), (20, -0.01)):  # one tick of 2 ms is done
        for _ in range(ticks):
            element.advance()
        assert element.actuator.strain == pytest.approx(strain, abs=1e-15)


@pytest.mark.parametrize(
    ('points', 'word'),
    [
        ([(0.1, [0.01, 0.02], []), (0.2, [], [])], 'one position'),
        ([(0.1, [0.01], []), (0.2, [], [])], 'one position'),
        ([(0.1, [0.01], [0.0, 0.0]), (0.2, [0.0], [])], 'one velocity'),
        ([(0.1, [0.01], [0.0]), (0.2, [0.0], [])], 'one velocity'),
    ],
    ids=str,
)
def test_trajectory_point_without_one_position_is_rejected(tmp_path, points, word):
    drive = [
        (0.0, 'strain_trajectory', TRAJECTORY, trajectory(*points)),
        (0.1, 'strain', 'std_msgs/msg/Float64', {'data': 0.01}),
    ]
    session = load_session(foreign_bag(tmp_path / 'bag', drive))
    report = replay_commands(MemoryElement(CASE_II), session)
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
