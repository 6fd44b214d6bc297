# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""metadata.yaml says what rosbag2 Jazzy's would (version 9), and is read from any version."""

import json
import re

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from mlmem_ros.bag import (
    LATCHED,
    RELIABLE,
    SENSOR_DATA,
    BagError,
    BagMetadata,
    FileInfo,
    TopicInfo,
)
from mlmem_ros.bag.metadata import parse_metadata, read_metadata

# Printed by yaml-cpp 0.8 from nodes put together as rosbag2_storage/yaml.hpp (Jazzy) does.
EMPTY_TEXT = """\
rosbag2_bagfile_information:
  version: 9
  storage_identifier: mcap
  duration:
    nanoseconds: 0
  starting_time:
    nanoseconds_since_epoch: 9223372036854775807
  message_count: 0
  topics_with_message_count:
    []
  compression_format: ""
  compression_mode: ""
  relative_file_paths:
    - bag_0.mcap
  files:
    - path: bag_0.mcap
      starting_time:
        nanoseconds_since_epoch: 9223372036854775807
      duration:
        nanoseconds: 0
      message_count: 0
  custom_data: ~
  ros_distro: jazzy"""

TEXT = """\
rosbag2_bagfile_information:
  version: 9
  storage_identifier: mcap
  duration:
    nanoseconds: 1500
  starting_time:
    nanoseconds_since_epoch: 1000
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
            deadline:
              sec: 9223372036
              nsec: 854775807
            lifespan:
              sec: 9223372036
              nsec: 854775807
            liveliness: automatic
            liveliness_lease_duration:
              sec: 9223372036
              nsec: 854775807
            avoid_ros_namespace_conventions: false
        type_description_hash: RIHS01_abc
      message_count: 3
    - topic_metadata:
        name: /bare
        type: std_msgs/msg/Int16
        serialization_format: cdr
        offered_qos_profiles:
          []
        type_description_hash: ""
      message_count: 0
  compression_format: ""
  compression_mode: ""
  relative_file_paths:
    - bag_0.mcap
  files:
    - path: bag_0.mcap
      starting_time:
        nanoseconds_since_epoch: 1000
      duration:
        nanoseconds: 1500
      message_count: 3
  custom_data:
    seed: 42
    design: "{\\"a\\": 1}"
    note: "plain words, and: no"
    two: "x\\ny"
  ros_distro: jazzy"""

METADATA = BagMetadata(
    topics=(
        TopicInfo('/level', 'std_msgs/msg/Int16', 'cdr', (LATCHED,), 'RIHS01_abc', 3),
        TopicInfo('/bare', 'std_msgs/msg/Int16'),
    ),
    files=(FileInfo('bag_0.mcap', 1000, 1500, 3),),
    relative_file_paths=('bag_0.mcap',),
    starting_time=1000,
    duration=1500,
    message_count=3,
    custom_data={
        'seed': '42',
        'design': '{"a": 1}',
        'note': 'plain words, and: no',
        'two': 'x\ny',
    },
)

# rosbag2_transport/test/resources/mcap/rewriter_a/metadata.yaml, shortened.
VERSION_5_TEXT = """\
rosbag2_bagfile_information:
  version: 5
  storage_identifier: mcap
  duration:
    nanoseconds: 100000000
  starting_time:
    nanoseconds_since_epoch: 0
  message_count: 50
  topics_with_message_count:
    - topic_metadata:
        name: b_basictypes
        type: test_msgs/msg/BasicTypes
        serialization_format: cdr
        offered_qos_profiles: "- history: 1\\n  depth: 1\\n  reliability: 1\\n  durability: 1\\n\
  deadline:\\n    sec: 9223372036\\n    nsec: 854775807\\n  lifespan:\\n    sec: 9223372036\\n\
    nsec: 854775807\\n  liveliness: 1\\n  liveliness_lease_duration:\\n    sec: 9223372036\\n\
    nsec: 854775807\\n  avoid_ros_namespace_conventions: false"
      message_count: 50
  compression_format: ""
  compression_mode: ""
  relative_file_paths:
    - rewriter_a_0.mcap
  files:
    - path: rewriter_a_0.mcap
      starting_time:
        nanoseconds_since_epoch: 0
      duration:
        nanoseconds: 100000000
      message_count: 50
"""


def said(text):
    """Return what a YAML text says to yaml-cpp: texts, in their order, and null."""
    return json.dumps(yaml.load(re.sub(r'(?m): null$', ': ~', text), yaml.BaseLoader))


def test_an_empty_bag_is_described_as_by_rosbag2():
    file = FileInfo('bag_0.mcap')
    metadata = BagMetadata(files=(file,), relative_file_paths=('bag_0.mcap',))
    assert said(metadata.text()) == said(EMPTY_TEXT)


def test_a_bag_is_described_as_by_rosbag2():
    assert said(METADATA.text()) == said(TEXT)


def test_the_mcap_record_holds_the_same_without_the_root():
    (root,) = json.loads(said(TEXT)).values()
    assert said(METADATA.record_text()) == json.dumps(root)


def test_what_is_written_is_read():
    assert parse_metadata(TEXT) == METADATA
    assert parse_metadata(METADATA.record_text()) == METADATA


def test_version_5_is_understood():
    metadata = parse_metadata(VERSION_5_TEXT)
    (profile,) = metadata.topics[0].offered_qos_profiles
    assert (metadata.version, metadata.message_count) == (5, 50)
    assert (profile.history, profile.durability) == ('keep_last', 'transient_local')
    assert metadata.custom_data == {}  # came with version 6


times = st.integers(0, 2**63 - 1)
counts = st.integers(0, 2**64 - 1)
profiles = st.lists(st.sampled_from([RELIABLE, LATCHED, SENSOR_DATA]), max_size=3).map(tuple)
topics = st.builds(TopicInfo, st.text(), st.text(), st.text(), profiles, st.text(), counts)
files = st.builds(FileInfo, st.text(), times, times, counts)
bags = st.builds(
    BagMetadata,
    topics=st.lists(topics, max_size=3).map(tuple),
    files=st.lists(files, max_size=3).map(tuple),
    relative_file_paths=st.lists(st.text(), max_size=3).map(tuple),
    starting_time=times,
    duration=times,
    message_count=counts,
    custom_data=st.dictionaries(st.text(max_size=20), st.text(), max_size=3),
)


@settings(deadline=None)
@given(bags)
def test_any_metadata_comes_back(metadata):
    assert parse_metadata(metadata.text()) == metadata


@pytest.mark.parametrize('text', ['', 'word', '- 1', '{', '{}', 'version: 9', TEXT[:300]])
def test_what_is_no_metadata_is_refused(text):
    with pytest.raises(BagError):
        parse_metadata(text)


def test_custom_data_is_strings():
    with pytest.raises(BagError, match="must map strings to strings; got 'seed': 42"):
        BagMetadata(custom_data={'seed': 42})


def test_the_file_is_written_and_renewed(tmp_path):
    BagMetadata().write(tmp_path)
    METADATA.write(tmp_path)
    assert (tmp_path / 'metadata.yaml').read_text() == METADATA.text()
    assert read_metadata(tmp_path) == METADATA
    assert [file.name for file in tmp_path.iterdir()] == ['metadata.yaml']  # nothing left over


def test_a_bag_without_metadata_has_none(tmp_path):
    assert read_metadata(tmp_path) is None


ALIASES = '  a: &a [x, x]\n  b0: &b0 [*a, *a]\n' + ''.join(
    f'  b{n}: &b{n} [*b{n - 1}, *b{n - 1}]\n' for n in range(1, 60)
)


@pytest.mark.parametrize('key', ['ros_distro', 'storage_identifier', 'custom_data'])
def test_a_list_that_has_no_end_is_no_text(key):
    """Sixty lines of YAML that would be 2^60 words when written out."""
    value = '{k: *b59}' if key == 'custom_data' else '*b59'
    text = re.sub(f'(?m)^  {key}:.*', '', EMPTY_TEXT) + f'\n{ALIASES}  {key}: {value}\n'
    assert parse_metadata(text.replace(f'  {key}: {value}', f'  {key}: mcap')).version == 9
    with pytest.raises(BagError, match='must be rosbag2 metadata'):
        parse_metadata(text)


def test_a_text_of_megabytes_is_not_parsed():
    with pytest.raises(BagError, match='at most 262144 characters'):
        parse_metadata('- a\n' * 10**6)
