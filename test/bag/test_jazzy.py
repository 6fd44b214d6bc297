# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Definitions equal those of ROS; messages survive CDR."""

import json
import sys
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mlmem_ros.bag import jazzy
from mlmem_ros.bag.errors import BagError
from mlmem_ros.contract.commands import COMMAND_TOPICS
from mlmem_ros.contract.streams import STREAMS

NODE_TYPES = sorted(
    {stream.type for stream in STREAMS.values()}
    | {topic.type for topic in COMMAND_TOPICS}
    | {'diagnostic_msgs/msg/DiagnosticArray', 'std_msgs/msg/String', 'std_msgs/msg/UInt64'}
    | {'sensor_msgs/msg/Image', 'visualization_msgs/msg/MarkerArray'}
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
    assert jazzy.find_definition(type_name).hash == hashes[type_name]


def test_bytes_after_the_message_are_ignored_and_cut_off():
    # A Float64MultiArray without data: header, two empty sequences and an offset, 16 bytes.
    cdr = bytes([0, 1, 0, 0]) + bytes(12)
    stray = b'\xde\xad\xbe\xef'
    assert jazzy.deserialize_message(cdr + stray, 'std_msgs/msg/Float64MultiArray').data.size == 0
    assert jazzy.trim_message(cdr + stray, 'std_msgs/msg/Float64MultiArray') == cdr


@pytest.mark.parametrize('cdr', [b'', b'\0\1\0', b'\1\1\0\0' + bytes(8), b'\0\2\0\0' + bytes(8)])
def test_bytes_without_a_cdr_header_are_rejected(cdr):
    with pytest.raises(BagError, match=r'Float64 must begin with a CDR header; got'):
        jazzy.deserialize_message(cdr, 'std_msgs/msg/Float64')


def test_wrong_fields_and_values_are_rejected():
    for values in ({'value': 1}, {'data': 300}):
        with pytest.raises(BagError, match='std_msgs/msg/UInt8'):
            jazzy.encode_message('std_msgs/msg/UInt8', **values)


@settings(deadline=None)
@given(st.sampled_from(NODE_TYPES), st.binary(max_size=200))
def test_any_bytes_decode_or_raise_a_bag_error(type_name, noise):
    with suppress(BagError):
        jazzy.deserialize_message(b'\x00\x01\x00\x00' + noise, type_name)
