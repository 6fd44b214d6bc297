# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A bag is in the formats of ROS 2 Jazzy: definitions equal those of ROS, messages survive CDR,
and metadata.yaml is that of rosbag2 (version 9), of which any version is read.
"""

import json
import re
import sys
from contextlib import suppress
from pathlib import Path

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from mlmem_ros.bag import jazzy
from mlmem_ros.bag.contents import (
    FileInfo,
    TopicInfo,
    describe_qos,
    format_metadata,
    parse_metadata,
)
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


# --- metadata.yaml -----------------------------------------------------------------------------

# As rosbag2 (Jazzy) prints it by yaml-cpp 0.8, but in fewer lines.
FOREVER = '{sec: 9223372036, nsec: 854775807}'
TEXT = f"""\
rosbag2_bagfile_information:
  version: 9
  storage_identifier: mcap
  duration: {{nanoseconds: 1500}}
  starting_time: {{nanoseconds_since_epoch: 1000}}
  message_count: 3
  topics_with_message_count:
    - topic_metadata:
        name: /level
        type: std_msgs/msg/Int16
        serialization_format: cdr
        offered_qos_profiles:
          - history: unknown
            depth: 0
            reliability: reliable
            durability: transient_local
            deadline: {FOREVER}
            lifespan: {FOREVER}
            liveliness: automatic
            liveliness_lease_duration: {FOREVER}
            avoid_ros_namespace_conventions: false
        type_description_hash: RIHS01_abc
      message_count: 3
    - topic_metadata:
        name: /bare
        type: std_msgs/msg/Int16
        serialization_format: cdr
        offered_qos_profiles: []
        type_description_hash: ""
      message_count: 0
  compression_format: ""
  compression_mode: ""
  relative_file_paths: [bag_0.mcap]
  files:
    - path: bag_0.mcap
      starting_time: {{nanoseconds_since_epoch: 1000}}
      duration: {{nanoseconds: 1500}}
      message_count: 3
  custom_data: ~
  ros_distro: jazzy"""

LATCHED = [describe_qos(durability='transient_local')]
TOPICS = (
    TopicInfo('/level', 'std_msgs/msg/Int16', 'RIHS01_abc', 3, LATCHED),
    TopicInfo('/bare', 'std_msgs/msg/Int16'),
)
FILES = (FileInfo('bag_0.mcap', 1000, 1500, 3),)


def said(text):
    """Return a YAML text as yaml-cpp reads it: texts, in order, and null."""
    return json.dumps(yaml.load(re.sub(r'(?m): null$', ': ~', text), yaml.BaseLoader))


def test_bag_is_described_as_by_rosbag2():
    """The times of an empty one are the largest number, and custom data are null."""
    assert said(format_metadata(TOPICS, FILES)) == said(TEXT)
    (root,) = yaml.safe_load(format_metadata((), (FileInfo('bag_0.mcap'),))).values()
    never = {'nanoseconds_since_epoch': 2**63 - 1}
    assert (root['starting_time'], root['duration']) == (never, {'nanoseconds': 0})
    assert (root['topics_with_message_count'], root['custom_data']) == ([], None)
    assert root['files'][0]['starting_time'] == never


def test_metadata_that_was_written_is_read():
    metadata = parse_metadata(TEXT)
    assert metadata.files == ('bag_0.mcap',)
    assert metadata.message_counts == {'/level': 3, '/bare': 0}
    assert not metadata.compressed


def test_version_5_is_understood():
    """Its profiles are a text; it has no custom data, which came with version 6."""
    document = yaml.safe_load(TEXT)
    (root,) = document.values()
    root['topics_with_message_count'][0]['topic_metadata']['offered_qos_profiles'] = '- depth: 1'
    del root['custom_data'], root['ros_distro'], root['files']
    metadata = parse_metadata(yaml.safe_dump(document))
    assert (metadata.files, sum(metadata.message_counts.values())) == (('bag_0.mcap',), 3)


@pytest.mark.parametrize(
    ('line', 'compressed'),
    [('FILE', True), ('message', True), ('none', False), (None, False)],
    ids=['file', 'message', 'none', 'version 2'],
)
def test_compression_is_recognized(line, compressed):
    line = f'  compression_mode: {line}\n' if line else ''
    text = TEXT.replace('  compression_mode: ""\n', line)
    assert parse_metadata(text).compressed is compressed


def test_any_name_comes_back():
    """Every character by itself, and what YAML has for something else."""
    words = ('', 'null', '~', 'yes', '1', '1e3', '2026-11-30', '- a', 'a: b', 'a #b', '{a', '*a',
             '!!a', '<<', '---', ' a ', 'a\n', 'a\n\n b', 'x ' * 200, '\U0001f600')  # fmt: skip
    names = [*words, *map(chr, range(0x180)), '\u2028', '\ufeff', '\uffff']
    counts = {name: number for number, name in enumerate(names)}
    topics = [TopicInfo(name, name, message_count=counts[name]) for name in names]
    assert parse_metadata(format_metadata(topics, FILES)).message_counts == counts


@pytest.mark.parametrize(
    'text',
    ['', 'word', '- 1', '{', '{}', 'version: 9', '"\\UFFFFFFFF"', '[' * 200_000, TEXT[:300]],
)
def test_invalid_metadata_is_rejected(text):
    with pytest.raises(BagError):
        parse_metadata(text)


ALIASES = '  a: &a [x, x]\n  b0: &b0 [*a, *a]\n' + ''.join(
    f'  b{n}: &b{n} [*b{n - 1}, *b{n - 1}]\n' for n in range(1, 60)
)


def test_text_that_is_a_list_of_aliases_is_rejected():
    """Sixty lines of YAML that would be 2^60 words when written out."""
    text = TEXT.replace('  compression_mode: ""\n', '') + f'\n{ALIASES}  compression_mode: '
    few = text.partition('  b9:')[0] + '  compression_mode: none\n'
    assert parse_metadata(few).files == ('bag_0.mcap',)  # PyYAML writes what is shared so
    with pytest.raises(BagError, match='must be rosbag2 metadata'):
        parse_metadata(f'{text}*b59\n')
