# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""metadata.yaml is that of rosbag2 Jazzy (version 9); any version is read."""

import json
import re

import pytest
import yaml

from mlmem_ros.bag.contents import (
    FileInfo,
    TopicInfo,
    describe_qos,
    format_metadata,
    parse_metadata,
)
from mlmem_ros.bag.errors import BagError

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
