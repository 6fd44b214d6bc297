# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The node's profile for Fast DDS."""

import os
import subprocess
import sys
from xml.etree import ElementTree

from mlmem_ros.ros.client.line import ASLEEP, LOOK
from mlmem_ros.ros.fast_dds import NAMES, PROFILE, profile_variable, use_profile
from mlmem_ros.testing.isolation import FAST_DISCOVERY

SERVICES = """
import rclpy
from std_srvs.srv import Trigger

def resident():
    with open('/proc/self/statm') as pages:
        return int(pages.read().split()[1]) * 4096

rclpy.init()
node = rclpy.create_node('node')
before = resident()
for number in range(50):
    node.create_service(Trigger, f'service_{number}', lambda request, response: response)
print(resident() - before)
"""


BESIDE = """
import rclpy
from std_msgs.msg import Empty

rclpy.init()
node = rclpy.create_node('node')
node.create_subscription(Empty, 'topic', print, 1)
print(node.create_publisher(Empty, 'topic', 1).get_subscription_count())
"""


def test_a_node_uses_the_profile_unless_it_has_one(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    environment = {}
    use_profile(environment)
    profile = ElementTree.parse(environment[profile_variable({})])
    (period,) = profile.iterfind('.//{*}leaseAnnouncement/{*}nanosec')
    assert float(period.text) < 0.5e9
    given = {'FASTDDS_DEFAULT_PROFILES_FILE': 'mine.xml'}
    use_profile(given)
    assert given == {'FASTDDS_DEFAULT_PROFILES_FILE': 'mine.xml'}
    (tmp_path / 'share' / 'fastdds').mkdir(parents=True)
    third = profile_variable({'AMENT_PREFIX_PATH': str(tmp_path)})
    assert third == 'FASTDDS_DEFAULT_PROFILES_FILE'


def test_nobody_is_forgotten_sooner_than_it_notices_that_it_stood_still():
    """A command that waited for a core for 4 s was, and its request then never arrived."""
    for profile in (PROFILE, FAST_DISCOVERY):
        (lease,) = ElementTree.parse(profile).iterfind('.//{*}leaseDuration/{*}sec')
        assert float(lease.text) > ASLEEP + LOOK


def test_the_ends_of_one_process_are_not_compared_with_each_other():
    """A bank of a hundred spent four fifths of its start on that; plain Fast DDS joins them."""
    plain = {name: value for name, value in os.environ.items() if name not in NAMES}
    joined = [
        int(subprocess.check_output([sys.executable, '-c', BESIDE], env=plain | given))
        for given in ({profile_variable(plain): str(PROFILE)}, {})
    ]
    assert joined == [0, 1]


def test_a_service_reserves_no_memory_for_a_hundred_messages():
    """Its two ends take 53 kB less: 100 x 260 bytes each."""
    plain = {name: value for name, value in os.environ.items() if name not in NAMES}
    small, usual = (
        int(subprocess.check_output([sys.executable, '-c', SERVICES], env=plain | given))
        for given in ({profile_variable(plain): str(PROFILE)}, {})
    )
    assert usual - small > 50 * 40e3
