# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Offered QoS is written as rosbag2 Jazzy writes it and read from any version."""

import pytest

from mlmem_ros.bag import LATCHED, RELIABLE, SENSOR_DATA, BagError, QosProfile
from mlmem_ros.bag.qos import INFINITE, dump_profiles, parse_profiles

# What Jazzy's yaml-cpp prints for a latched topic discovered on Fast DDS.
LATCHED_TEXT = """\
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
  avoid_ros_namespace_conventions: false"""

# rosbag2_storage/test/rosbag2_storage/test_qos.cpp, "supports_version_4".
VERSION_4_TEXT = """\
- history: 1
  depth: 10
  reliability: 1
  durability: 2
  deadline:
    sec: 0
    nsec: 0
  lifespan:
    sec: 0
    nsec: 0
  liveliness: 0
  liveliness_lease_duration:
    sec: 0
    nsec: 0
  avoid_ros_namespace_conventions: false
"""


def test_a_latched_profile_is_written_to_the_byte():
    assert dump_profiles((LATCHED,)) == LATCHED_TEXT


def test_no_profile_is_an_empty_list():
    assert dump_profiles(()) == '[]'


@pytest.mark.parametrize('profile', [RELIABLE, LATCHED, SENSOR_DATA, QosProfile(depth=5)])
def test_profiles_come_back(profile):
    assert parse_profiles(dump_profiles((profile, RELIABLE))) == (profile, RELIABLE)


def test_numbers_of_version_4_are_understood():
    (profile,) = parse_profiles(VERSION_4_TEXT)
    assert profile == QosProfile(
        history='keep_last',
        depth=10,
        reliability='reliable',
        durability='volatile',
        deadline=0,
        lifespan=0,
        liveliness='system_default',
        liveliness_lease_duration=0,
    )


def test_the_infinity_of_foxy_is_infinite():
    # Fast DDS of Foxy wrote sec 0x7fffffff, nsec 0xffffffff.
    text = LATCHED_TEXT.replace('9223372036', '2147483647').replace('854775807', '4294967295')
    assert parse_profiles(text)[0].deadline == INFINITE


def test_a_policy_of_the_future_is_unknown():
    (profile,) = parse_profiles(LATCHED_TEXT.replace('transient_local', 'engraved'))
    assert profile.durability == 'unknown'


def test_a_word_that_is_no_policy_is_refused():
    with pytest.raises(BagError, match=r"reliability must be one of .*; got 'certain'"):
        QosProfile(reliability='certain')


@pytest.mark.parametrize('text', ['{', 'word', '- 1', '- history: 1', '- {depth: x}'])
def test_what_is_no_list_of_profiles_is_refused(text):
    with pytest.raises(BagError):
        parse_profiles(text)
