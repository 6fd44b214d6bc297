# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Definitions equal those of ROS; messages survive CDR."""

import json
import sys
import time
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mlmem_ros.bag import BagError, Definition, codec_of, jazzy

NODE_TYPES = [
    'diagnostic_msgs/msg/DiagnosticArray',
    'diagnostic_msgs/msg/DiagnosticStatus',
    'sensor_msgs/msg/Image',
    'sensor_msgs/msg/Imu',
    'sensor_msgs/msg/JointState',
    'sensor_msgs/msg/Range',
    'std_msgs/msg/Empty',
    'std_msgs/msg/Float32MultiArray',
    'std_msgs/msg/Float64',
    'std_msgs/msg/Float64MultiArray',
    'std_msgs/msg/Int16',
    'std_msgs/msg/String',
    'std_msgs/msg/UInt64',
    'std_msgs/msg/UInt8',
    'trajectory_msgs/msg/JointTrajectory',
    'visualization_msgs/msg/MarkerArray',
]


def test_the_text_has_the_layout_of_rosbag2():
    # Root, then each dependency once, depth first, siblings sorted by name.
    rule = '=' * 80
    assert jazzy().definition('trajectory_msgs/msg/JointTrajectory').text == (
        'std_msgs/Header header\n'
        'string[] joint_names\n'
        'trajectory_msgs/JointTrajectoryPoint[] points\n'
        f'\n{rule}\nMSG: std_msgs/Header\n'
        'builtin_interfaces/Time stamp\n'
        'string frame_id\n'
        f'\n{rule}\nMSG: builtin_interfaces/Time\n'
        'int32 sec\n'
        'uint32 nanosec\n'
        f'\n{rule}\nMSG: trajectory_msgs/JointTrajectoryPoint\n'
        'float64[] positions\n'
        'float64[] velocities\n'
        'float64[] accelerations\n'
        'float64[] effort\n'
        'builtin_interfaces/Duration time_from_start\n'
        f'\n{rule}\nMSG: builtin_interfaces/Duration\n'
        'int32 sec\n'
        'uint32 nanosec\n'
    )


@pytest.mark.parametrize('type_name', NODE_TYPES)
def test_hashes_are_those_of_the_installed_interfaces(type_name):
    package, _, name = type_name.split('/')
    file = Path(sys.prefix, 'share', package, 'msg', f'{name}.json')
    if not file.exists():
        pytest.skip(f'{package} is not installed')
    hashes = {
        item['type_name']: item['hash_string']
        for item in json.loads(file.read_text())['type_hashes']
    }
    assert jazzy().definition(type_name).hash == hashes[type_name]


@pytest.mark.parametrize('type_name', NODE_TYPES)
def test_a_definition_is_enough_to_build_its_codec(type_name):
    definition = jazzy().definition(type_name)
    assert codec_of([definition]).definition(type_name) == definition


@pytest.mark.parametrize('type_name', NODE_TYPES)
def test_a_definition_without_a_hash_is_known_by_its_fields(type_name):
    nameless = replace(jazzy().definition(type_name), hash='')
    assert codec_of([nameless]).knows(type_name)
    other = replace(nameless, text=f'int8 first\n{nameless.text}')
    with pytest.raises(BagError, match='has other fields than in ROS 2 Jazzy'):
        codec_of([other]).deserialize(bytes(100), type_name)


def test_a_type_of_the_same_name_with_another_hash_is_refused():
    other = replace(jazzy().definition('std_msgs/msg/Int16'), hash='RIHS01_' + '0' * 64)
    with pytest.raises(BagError, match='its hash is RIHS01_000'):
        codec_of([other]).deserialize(bytes(6), 'std_msgs/msg/Int16')


IDL = 'module demo { module msg { %s }; };'
DEMO = f'\n{"=" * 80}\nMSG: demo/B\n'
GREEDY = {
    'an array of texts': ('ros2msg', 'string[100000000] x'),
    'blanks': ('ros2msg', ' ' * 5_000_000),
    'fields': ('ros2msg', ''.join(f'int8 a{n}\n' for n in range(100_000))),
    'an empty array': ('ros2msg', 'uint8[0] x'),
    'arrays of arrays': ('ros2msg', f'B[1999] x{DEMO}C[1999] x{DEMO.replace("B", "C")}int8 x'),
    'shells': (
        'ros2msg',
        'A0[] x' + ''.join(f'\n{"=" * 80}\nMSG: demo/A{n}\nA{n + 1} x' for n in range(300)),
    ),
    'a shift': ('ros2idl', IDL % 'const long X = 1 << 30000000000; struct A { long x; };'),
    'brackets': (
        'ros2idl',
        IDL % f'const long X = {"(" * 20}1{")" * 20}; struct A {{ long x; }};',
    ),
    'dimensions': ('ros2idl', IDL % f'struct A {{ long x{"[1]" * 1000}; }};'),
    'constants': ('ros2idl', IDL % ('const long X = 1;' * 900 + 'struct A { long x; };')),
    'texts': ('ros2idl', IDL % f'const string X = {5000 * "1 "}; struct A {{ long x; }};'),
    'a comment': ('ros2idl', '/*' * 500_000),
}


@pytest.mark.parametrize('what', GREEDY)
def test_a_definition_that_asks_for_too_much_is_left_alone(what):
    encoding, text = GREEDY[what]
    begin = time.process_time()
    codec = codec_of([Definition('demo/msg/A', text, encoding)])
    with pytest.raises(BagError):
        codec.deserialize(bytes([0, 1, 0, 0]) + b'\xff' * 1000, 'demo/msg/A')
    assert time.process_time() - begin < 2.0


def test_comments_do_not_count():
    """Seven pages of them, and an IDL file as rosidl writes it, texts of comments and all."""
    text = '# nothing\n' * 20_000 + 'int32[9] x   # nine\n'
    assert codec_of([Definition('demo/msg/A', text)]).knows('demo/msg/A')
    words = '@verbatim (language="comment", text="%s")' % ('twenty thousand of them" "' * 1000)
    fields = '@default (value=-1) long x; sequence<double, 3> y; nine z; string<=5 t;'
    text = IDL % (
        f'module A_Constants {{ const long X = -1; }}; typedef double nine[9];'
        f'{words} struct A {{ {fields.replace("string<=5", "string<5>")} }};'
    )
    codec = codec_of([Definition('demo/msg/A', text, 'ros2idl')])
    assert codec.knows('demo/msg/A')


def test_a_message_survives_cdr():
    codec = jazzy()
    dimension = codec.message('std_msgs/msg/MultiArrayDimension', label='sample', size=3, stride=3)
    layout = codec.message('std_msgs/msg/MultiArrayLayout', dim=[dimension], data_offset=0)
    data = np.array([0.1, -0.2, np.inf], dtype=np.float32)
    message = codec.message('std_msgs/msg/Float32MultiArray', layout=layout, data=data)
    back = codec.deserialize(codec.serialize(message), 'std_msgs/msg/Float32MultiArray')
    assert back.layout == layout
    np.testing.assert_array_equal(back.data, data)


def test_cdr_is_that_of_ros():
    # Encapsulation (little endian), then a double.
    message = jazzy().message('std_msgs/msg/Float64', data=1.0)
    assert jazzy().serialize(message) == bytes.fromhex('00010000 000000000000f03f')


def test_bytes_after_the_message_are_ignored_and_cut_off():
    # A Float64MultiArray without data: header, two empty sequences and an offset, 16 bytes.
    cdr = bytes([0, 1, 0, 0]) + bytes(12)
    stray = b'\xde\xad\xbe\xef'
    assert jazzy().deserialize(cdr + stray, 'std_msgs/msg/Float64MultiArray').data.size == 0
    assert jazzy().trim(cdr + stray, 'std_msgs/msg/Float64MultiArray') == cdr
    # A type without a sequence of 8-byte numbers has no stray bytes to look for.
    image = bytes(10_000)
    assert jazzy().trim(image, 'sensor_msgs/msg/Image') is image


@pytest.mark.parametrize('cdr', [b'', b'\0\1\0', b'\1\1\0\0' + bytes(8), b'\0\2\0\0' + bytes(8)])
def test_bytes_without_a_cdr_header_are_refused(cdr):
    with pytest.raises(BagError, match=r'Float64 must begin with a CDR header; got'):
        jazzy().deserialize(cdr, 'std_msgs/msg/Float64')


def test_an_idl_definition_is_understood():
    text = (
        f'{"=" * 80}\nIDL: demo_msgs/msg/Point\n'
        'module demo_msgs { module msg { struct Point { double x; }; }; };\n'
    )
    codec = codec_of([Definition('demo_msgs/msg/Point', text, 'ros2idl')])
    point = codec.message('demo_msgs/msg/Point', x=2.5)
    assert codec.deserialize(codec.serialize(point), 'demo_msgs/msg/Point').x == 2.5


def test_a_definition_without_text_is_taken_from_jazzy():
    codec = codec_of([Definition('std_msgs/msg/Int16', '', '')])
    assert codec.definition('std_msgs/msg/Int16') == jazzy().definition('std_msgs/msg/Int16')


def test_a_definition_that_cannot_be_parsed_spoils_no_other():
    codec = codec_of(
        [Definition('demo_msgs/msg/Bad', '<<<'), jazzy().definition('std_msgs/msg/Int16')]
    )
    assert codec.message('std_msgs/msg/Int16', data=1).data == 1
    with pytest.raises(BagError, match="'demo_msgs/msg/Bad' is not known"):
        codec.message('demo_msgs/msg/Bad')


def test_wrong_fields_are_refused():
    with pytest.raises(BagError, match='fields must be those of std_msgs/msg/Int16'):
        jazzy().message('std_msgs/msg/Int16', value=1)


def test_a_value_out_of_range_is_refused():
    message = jazzy().message('std_msgs/msg/UInt8', data=300)
    with pytest.raises(BagError, match='must be a valid std_msgs/msg/UInt8'):
        jazzy().serialize(message)


@settings(deadline=None)
@given(st.sampled_from(NODE_TYPES), st.binary(max_size=200))
def test_any_bytes_are_a_message_or_an_error_of_ours(type_name, noise):
    with suppress(BagError):
        jazzy().deserialize(b'\x00\x01\x00\x00' + noise, type_name)
