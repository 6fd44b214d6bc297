# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Processes that end with their parent, and no sooner; parameters on their command line; their
profile for Fast DDS.
"""

import subprocess
from xml.etree import ElementTree

import pytest
import rclpy
from nodes import program
from rclpy.node import Node
from timeouts import TIMEOUT_S

from mlmem_ros.ros.node_process import (
    build_node_arguments,
    find_profile_variable,
    use_profile,
)

SERVES = 'http.server', ['0', '--bind', '127.0.0.1']
"""A program that runs until it is ended."""

PARENT = """
import sys, threading, time
from mlmem_ros.ros.node_process import run_child_process
with run_child_process(*eval(sys.argv[1]), stderr=2) as process:
    print(process.pid, flush=True)
    time.sleep(60)
"""


def test_process_ends_with_its_killed_parent():
    pipes = {'stdout': subprocess.PIPE, 'stderr': subprocess.PIPE}
    parent = program('-c', PARENT, repr(SERVES), **pipes)
    parent.stdout.readline()  # the run_child_process runs
    parent.kill()
    parent.communicate(timeout=TIMEOUT_S)  # the run_child_process has closed its end, too


@pytest.mark.parametrize(
    'text',
    ["/home/o'brien/session", 'C:\\new "one"', "'", '1', 'true', 'ä b: {c} #', 'a\nb\t', ''],
)
def test_any_text_survives_as_a_parameter(text):
    context = rclpy.Context()
    rclpy.init(args=['x', *build_node_arguments('/a/b', {'path': text, 'n': 2})], context=context)
    try:
        node = Node('b', namespace='a', context=context, start_parameter_services=False)
        assert node.declare_parameter('path', 'none').value == text
        assert node.declare_parameter('n', 1).value == 2
        node.destroy_node()
    finally:
        rclpy.try_shutdown(context=context)


def test_node_uses_the_profile_unless_it_has_one(tmp_path):
    environment = {}
    use_profile(environment)
    profile = ElementTree.parse(environment[find_profile_variable({})])
    (period,) = profile.iterfind('.//{*}leaseAnnouncement/{*}nanosec')
    assert float(period.text) < 0.5e9
    properties = {each.findtext('{*}name'): each for each in profile.iterfind('.//{*}property')}
    apart = properties['fastdds.ignore_local_endpoints']  # or a bank of a hundred starts slowly
    assert apart.findtext('{*}value') == 'true'
    given = {'FASTDDS_DEFAULT_PROFILES_FILE': 'mine.xml'}
    use_profile(given)
    assert given == {'FASTDDS_DEFAULT_PROFILES_FILE': 'mine.xml'}
    (tmp_path / 'share' / 'fastdds').mkdir(parents=True)
    third = find_profile_variable({'AMENT_PREFIX_PATH': str(tmp_path)})
    assert third == 'FASTDDS_DEFAULT_PROFILES_FILE'
