# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Replay of other recorders' bags, of damaged ones and of bags without a session."""

import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from mlmem import MemoryElement, Refused
from mlmem.instrument.instrument import Units
from mlmem.physics import CASE_II
from mlmem_ros.bag.errors import BagError
from mlmem_ros.bag.mcap_part import RECORD_BYTES
from mlmem_ros.contract.commands import parse_acceleration, parse_trajectory
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


def test_bag_that_takes_too_much_memory_is_rejected(tmp_path, monkeypatch):
    monkeypatch.setattr(data, 'MAX_SESSION_BYTES', 10 * RECORD_BYTES)
    for bag in (foreign_bag(tmp_path / 'bag', 10 * WRITE_LEVEL_1_THEN_PROBE), DATA / 'life'):
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


def joint_state(name, position):
    """Return the values of a JointState."""
    stamp = JAZZY.types['builtin_interfaces/msg/Time'](0, 0)
    header = JAZZY.types['std_msgs/msg/Header'](stamp, '')
    absent = {'velocity': np.array([]), 'effort': np.array([])}
    return {'header': header, 'name': [name], 'position': np.array([position]), **absent}


def test_message_that_is_no_command_is_refused_in_a_replay(tmp_path):
    """A position that is NaN asks for nothing: ros2_control sends it before a controller does."""
    states = [('substrate', np.nan), ('elbow', 0.1), ('substrate', 0.02 * Units().elongation)]
    drive = [
        (0.1 * n, 'joint_commands', 'sensor_msgs/msg/JointState', joint_state(*state))
        for n, state in enumerate(states)
    ]
    element = MemoryElement(CASE_II)
    report = replay_commands(element, load_session(foreign_bag(tmp_path / 'bag', drive)))
    (refusal,) = report.refused
    assert "it must have a position of the joint 'substrate'; got ['elbow']" in refusal
    assert report.commands == 1
    assert element.actuator.motion.target == pytest.approx(0.02)


def test_acceleration_of_an_imu_is_in_units_of_the_element():
    """At 1 cm and (0.1 ms)^2 a hundred m/s^2 are 1e-4 of the unit."""
    message = SimpleNamespace(
        linear_acceleration=SimpleNamespace(x=-100.0), linear_acceleration_covariance=[0.0]
    )
    assert parse_acceleration(message, Units()).acceleration == pytest.approx(-1e-4)
    message.linear_acceleration_covariance[0] = -1.0  # no accelerometer
    assert math.isnan(parse_acceleration(message, Units()).acceleration)


def trajectory(*points):
    """Return a JointTrajectory of points (seconds, positions, velocities)."""
    found = [
        SimpleNamespace(
            positions=positions, velocities=velocities,
            time_from_start=SimpleNamespace(sec=int(t), nanosec=round(1e9 * (t % 1.0))),
        )
        for t, positions, velocities in points
    ]  # fmt: skip
    return SimpleNamespace(points=found, joint_names=['substrate'])


def test_trajectory_in_metres_is_a_profile_of_strains():
    length = Units().elongation
    message = trajectory((0.02, [0.02 * length], [0.0]), (1.06, [-0.01 * length], [0.1 * length]))
    command = parse_trajectory(message, Units())
    assert command.times == pytest.approx((0.02, 1.06))
    assert command.strains == pytest.approx((0.02, -0.01))
    assert command.rates == pytest.approx((0.0, 0.1))
    assert command.joint == 'substrate'


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
def test_trajectory_point_without_one_position_is_refused(points, word):
    with pytest.raises(Refused, match=word):
        parse_trajectory(trajectory(*points), Units())


def test_texts_from_a_bag_are_not_markup(tmp_path, capsys):
    """Names that rich would read as styles or an emoji, or that clear the terminal."""
    node = '/[/red]:smile:\x1b[2J'
    drive = [(0.0, 'strain', 'std_msgs/msg/Float64', {'data': 0.02})]
    assert main(['inspect', str(foreign_bag(tmp_path / 'bag', drive, node=node))]) == 0
    told = capsys.readouterr().out
    assert '/[/red]:smile:\\x1b[2J' in told
    assert '\x1b' not in told
