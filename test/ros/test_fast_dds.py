# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The node's profile for Fast DDS."""

import os
import subprocess
from xml.etree import ElementTree

from nodes import program

from mlmem_ros.ros.client.line import CHECK_PERIOD_S, MAX_STANDSTILL_S
from mlmem_ros.ros.process import (
    PROFILE_PATH,
    PROFILE_VARIABLES,
    find_profile_variable,
    use_profile,
)
from mlmem_ros.testing.running import FAST_DISCOVERY

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
    profile = ElementTree.parse(environment[find_profile_variable({})])
    (period,) = profile.iterfind('.//{*}leaseAnnouncement/{*}nanosec')
    assert float(period.text) < 0.5e9
    given = {'FASTDDS_DEFAULT_PROFILES_FILE': 'mine.xml'}
    use_profile(given)
    assert given == {'FASTDDS_DEFAULT_PROFILES_FILE': 'mine.xml'}
    (tmp_path / 'share' / 'fastdds').mkdir(parents=True)
    third = find_profile_variable({'AMENT_PREFIX_PATH': str(tmp_path)})
    assert third == 'FASTDDS_DEFAULT_PROFILES_FILE'


def test_nobody_is_forgotten_sooner_than_it_notices_that_it_stood_still():
    """A command that waited for a core for 4 s was, and its request then never arrived."""
    (lease,) = ElementTree.parse(FAST_DISCOVERY).iterfind('.//{*}leaseDuration/{*}sec')
    assert float(lease.text) > MAX_STANDSTILL_S + CHECK_PERIOD_S


def test_profile_of_a_node_keeps_the_default_lease():
    """20 s; with 60 s a plain client talked to the ghost of a node killed 25 s before, 3 of 3."""
    assert not list(ElementTree.parse(PROFILE_PATH).iterfind('.//{*}leaseDuration'))


def printed(code, profile):
    """Return the number that a program prints, with a profile or that of Fast DDS."""
    given = {name: value for name, value in os.environ.items() if name not in PROFILE_VARIABLES}
    if profile is not None:
        given[find_profile_variable(given)] = str(profile)
    with program('-c', code, env=given, stdout=subprocess.PIPE) as process:
        return int(process.stdout.read())


def test_the_ends_of_one_process_are_not_compared_with_each_other():
    """A bank of a hundred spent four fifths of its start on that; plain Fast DDS joins them."""
    assert [printed(BESIDE, profile) for profile in (PROFILE_PATH, None)] == [0, 1]


def test_a_service_reserves_no_memory_for_a_hundred_messages():
    """Its two ends take 53 kB less: 100 x 260 bytes each."""
    small, usual = (printed(SERVICES, profile) for profile in (PROFILE_PATH, None))
    assert usual - small > 50 * 40e3
