# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The node's profile for Fast DDS."""

import os
import subprocess
from xml.etree import ElementTree

from nodes import program

from mlmem_ros.ros.process import (
    PROFILE_PATH,
    PROFILE_VARIABLES,
    find_profile_variable,
    use_profile,
)

BESIDE = """
import rclpy
from std_msgs.msg import Empty

rclpy.init()
node = rclpy.create_node('node')
node.create_subscription(Empty, 'topic', print, 1)
print(node.create_publisher(Empty, 'topic', 1).get_subscription_count())
"""


def test_node_uses_the_profile_unless_it_has_one(tmp_path):
    environment = {}
    use_profile(environment)
    profile = ElementTree.parse(environment[find_profile_variable({})])
    (period,) = profile.iterfind('.//{*}leaseAnnouncement/{*}nanosec')
    assert float(period.text) < 0.5e9
    given = {'FASTDDS_DEFAULT_PROFILES_FILE': 'mine.xml'}
    use_profile(given)
    assert given == {'FASTDDS_DEFAULT_PROFILES_FILE': 'mine.xml'}
    (tmp_path / 'share' / 'fastdds').mkdir(parents=True)
    third = find_profile_variable({'AMENT_PREFIX_PATH': str(tmp_path)})
    assert third == 'FASTDDS_DEFAULT_PROFILES_FILE'


def printed(code, profile):
    """Return the number that a program prints, with a profile or that of Fast DDS."""
    given = {name: value for name, value in os.environ.items() if name not in PROFILE_VARIABLES}
    if profile is not None:
        given[find_profile_variable(given)] = str(profile)
    with program('-c', code, env=given, stdout=subprocess.PIPE) as process:
        return int(process.stdout.read())


def test_profile_keeps_endpoints_of_one_process_apart():
    """A bank of a hundred spent four fifths of its start on that; plain Fast DDS joins them."""
    assert [printed(BESIDE, profile) for profile in (PROFILE_PATH, None)] == [0, 1]
