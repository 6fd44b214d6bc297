# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Offered QoS is written as rosbag2 Jazzy writes it, and renewed from any version."""

import pytest

from mlmem_ros.bag.metadata import LATCHED, RELIABLE, offered, renewed

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


@pytest.mark.parametrize('text', [RELIABLE, LATCHED, offered('best_effort'), RELIABLE + '\n'])
def test_what_we_write_is_what_jazzy_writes(text):
    assert renewed(text) == text.rstrip('\n')


def test_numbers_of_version_4_become_words():
    words = renewed(VERSION_4_TEXT).split()
    for name, value in (
        ('history', 'keep_last'),
        ('depth', '10'),
        ('reliability', 'reliable'),
        ('durability', 'volatile'),
        ('liveliness', 'system_default'),
    ):
        assert words[words.index(f'{name}:') + 1] == value


def test_an_unknown_policy_is_unknown():
    assert 'durability: unknown' in renewed(LATCHED.replace('transient_local', 'engraved'))


@pytest.mark.parametrize('text', ['', '{', 'word', '- 1', '- history: 1', '- {depth: x}'])
def test_an_invalid_list_of_profiles_is_empty(text):
    assert renewed(text) in ('', '[]')
