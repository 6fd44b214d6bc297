# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Other readers open our bags, with every message of every topic."""

import numpy as np
import pytest
from rosbags.highlevel import AnyReader
from rosbags.interfaces import QosDurability, QosReliability

from mlmem_ros.bag import jazzy
from mlmem_ros.bag.contents import LATCHED_QOS, RELIABLE_QOS, format_qos
from mlmem_ros.bag.writer import BagWriter

message = jazzy.make_message
stamp = message('builtin_interfaces/msg/Time', sec=1, nanosec=2)
header = message('std_msgs/msg/Header', stamp=stamp, frame_id='substrate')
layout = message(
    'std_msgs/msg/MultiArrayLayout',
    dim=[message('std_msgs/msg/MultiArrayDimension', label='sample', size=2, stride=2)],
    data_offset=0,
)
# One message of each kind that the node publishes or takes.
PUBLISHED = {
    '/mlmem/level': message('std_msgs/msg/Int16', data=-1),
    '/mlmem/probe': message('std_msgs/msg/Empty'),
    '/mlmem/strain': message('std_msgs/msg/Float64', data=0.125),
    '/mlmem/write_level': message('std_msgs/msg/UInt8', data=5),
    '/mlmem/session': message('std_msgs/msg/String', data='{"größe": 1}'),
    '/mlmem/echo': message(
        'std_msgs/msg/Float32MultiArray', layout=layout, data=np.array([1, 2], np.float32)
    ),
    '/mlmem/wall': message(
        'std_msgs/msg/Float64MultiArray', layout=layout, data=np.array([1.5, 2.5])
    ),
    '/mlmem/range': message(
        'sensor_msgs/msg/Range',
        header=header,
        radiation_type=0,
        field_of_view=0.1,
        min_range=0.0,
        max_range=9.0,
        range=float('inf'),
        variance=0.0,
    ),
    '/mlmem/joint_states': message(
        'sensor_msgs/msg/JointState',
        header=header,
        name=['substrate', 'transducer'],
        position=np.array([0.1, 0.2]),
        velocity=np.array([0.0, 0.0]),
        effort=np.array([]),
    ),
    '/mlmem/outcome': message(
        'diagnostic_msgs/msg/DiagnosticStatus',
        level=0,
        name='write',
        message='verified',
        hardware_id='mlmem',
        values=[message('diagnostic_msgs/msg/KeyValue', key='level', value='5')],
    ),
}


@pytest.fixture(scope='module')
def bag(tmp_path_factory):
    """A split bag with ten messages on each topic."""
    path = tmp_path_factory.mktemp('others') / 'bag'
    with BagWriter(path, max_duration=5e-9, custom_data={'a': '1'}) as writer:
        for topic, item in PUBLISHED.items():
            latched = f'{LATCHED_QOS}\n{RELIABLE_QOS}'
            qos = latched if topic == '/mlmem/level' else format_qos('best_effort')
            writer.add_topic(topic, item.__msgtype__, qos)
        for time in range(10):
            for topic, item in PUBLISHED.items():
                writer.write(topic, jazzy.serialize_message(item), time)
    return path


def test_rosbags_decodes_every_message(bag):
    with AnyReader([bag]) as reader:  # compares the hashes with those it computes itself
        found = [
            (connection.topic, time, reader.deserialize(raw, connection.msgtype))
            for connection, time, raw in reader.messages()
        ]
        assert reader.message_count == 10 * len(PUBLISHED)
    expected = [(topic, time, item) for time in range(10) for topic, item in PUBLISHED.items()]
    assert [entry[:2] for entry in found] == [entry[:2] for entry in expected]
    # Classes differ, for rosbags builds its own from our definitions; so compare CDR.
    assert [jazzy.serialize_message(entry[2]) for entry in found] == [
        jazzy.serialize_message(entry[2]) for entry in expected
    ]


def test_rosbags_finds_qos_and_custom_data(bag):
    with AnyReader([bag]) as reader:
        (connection,) = [c for c in reader.connections if c.topic == '/mlmem/level']
        latched, reliable = connection.ext.offered_qos_profiles
        assert latched.durability == QosDurability.TRANSIENT_LOCAL
        assert reliable.reliability == QosReliability.RELIABLE
        assert reader.readers[0].storage.metadata.custom == {'a': '1'}


def test_stray_bytes_of_rclpy_are_cut_off():
    # The empty effort at the end makes Fast DDS append 4 bytes, which rosbags would refuse.
    serialization = pytest.importorskip('rclpy.serialization')
    sensor_msgs = pytest.importorskip('sensor_msgs.msg')
    raw = serialization.serialize_message(sensor_msgs.JointState(name=['a'], position=[1.0]))
    trimmed = jazzy.trim_message(raw, 'sensor_msgs/msg/JointState')
    assert raw.startswith(trimmed)
    # Compared by length, for the padding between fields is unwritten memory as well.
    back = jazzy.deserialize_message(raw, 'sensor_msgs/msg/JointState')
    assert len(trimmed) == len(jazzy.serialize_message(back))
    assert (back.name, back.position.tolist(), back.effort.size) == (['a'], [1.0], 0)
