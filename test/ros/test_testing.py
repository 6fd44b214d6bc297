# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A memory node for the length of a test, in its process and in another; processes that end with
their parent, and no sooner; parameters on their command line; their profile for Fast DDS.
"""

import socket
import subprocess
from pathlib import Path
from xml.etree import ElementTree

import pytest
import rclpy
from nodes import QUICK, TICK, check_node, end_node, node_parameters, program
from rclpy.node import Node
from sensor_msgs.msg import JointState
from suite import TIMEOUT_S

from mlmem_ros import RequestError, RequestRefused
from mlmem_ros.ros.node_process import build_node_arguments, find_profile_variable, use_profile
from mlmem_ros.testing import assert_written, faults, frozen_clock, memory_node
from mlmem_ros.testing.running import is_domain_used

DATA = Path(__file__).parents[1] / 'data'


def test_memory_node_has_name_parameters_log_and_end(tmp_path):
    """One in a process of its own is in test_recording.py."""
    file = tmp_path / 'given.yaml'
    file.write_text('/**:\n  ros__parameters:\n    write: {attempts: 5}\n')
    with memory_node(node_parameters(QUICK), name='lent', namespace='/arm', file=file) as node:
        check_node(node, '/arm/lent')
        assert node.memory.parameters('write.attempts').wait() == {'write.attempts': 5}
        end_node(node)
        assert not node.running


def test_domain_is_in_use_while_a_participant_listens():
    """Here a socket at the port of the third participant of domain 101, which no run claims."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as participant:
        participant.bind(('127.0.0.1', 7410 + 250 * 101 + 4))
        assert is_domain_used(101)
    assert not is_domain_used(101)


def test_nodes_follow_a_frozen_clock(start):
    node = start({'use_sim_time': True}, name='held')
    with frozen_clock(node) as clock:
        writing = node.memory.write(5)
        clock.advance(0.02)
        assert not writing.done()
        assert clock.ticks == round(0.02 / TICK)
        assert clock.finish(writing).level == 5
        stamped = []
        node.memory.node.create_subscription(JointState, '/held/joint_states', stamped.append, 10)
        clock.advance_until(lambda: stamped)
        stamp = stamped[0].header.stamp
        assert clock.now - 0.1 < stamp.sec + 1e-9 * stamp.nanosec <= clock.now
        with pytest.raises(TimeoutError, match=r'0\.1 s of ROS time'):
            clock.advance_until(lambda: False, within=0.1)


def test_faults_are_removed_whatever_happens(memory):
    client = memory.memory
    client.set_parameters({'faults.sensor_noise': 1e-9, 'write.method': 'strain'}).wait()
    stuck = faults(memory, sensor_noise=1e-8, actuator_stuck=True)
    with pytest.raises(RequestError, match='does not follow'), stuck:
        client.write(3).wait()
    before = {'faults.sensor_noise': 1e-9, 'faults.actuator_stuck': False}
    for wrong in ({'gain': 0.5}, {'actuator_stuck': True, 'stuck_cell': 99_999}):
        assert client.parameters(*before).wait() == before
        with pytest.raises(RequestRefused, match=list(wrong)[-1]), faults(memory, **wrong):
            pass
    assert client.parameters(*before).wait() == before
    client.set_parameters({'faults.sensor_noise': 0.0, 'write.method': 'kick'}).wait()


def test_assert_written_checks_the_last_write(tmp_path, memory):
    assert_written(DATA / 'aborted_write', 3)  # the first was aborted
    with pytest.raises(AssertionError, match='found level 3; expected 1'):
        assert_written(DATA / 'aborted_write', 1)
    bag = tmp_path / 'session'
    memory.memory.record(path=str(bag)).wait()
    memory.memory.set_parameters({'write.method': 'strain'}).wait()
    with faults(memory, actuator_stuck=True), pytest.raises(RequestError):
        memory.memory.write(4).wait()
    memory.memory.set_parameters({'write.method': 'kick'}).wait()
    memory.memory.record(False).wait()
    with pytest.raises(AssertionError, match='the actuator does not follow'):
        assert_written(bag, 4)


PARENT = """
import time
from mlmem_ros.ros.node_process import run_child_process
with run_child_process('http.server', ['0', '--bind', '127.0.0.1'], stderr=2) as process:
    print(process.pid, flush=True)
    time.sleep(60)
"""


def test_process_ends_with_its_killed_parent():
    pipes = {'stdout': subprocess.PIPE, 'stderr': subprocess.PIPE}
    parent = program('-c', PARENT, **pipes)
    parent.stdout.readline()  # the child runs until it is ended
    parent.kill()
    parent.communicate(timeout=TIMEOUT_S)  # the child has closed its end, too


def test_any_text_survives_as_a_parameter():
    texts = ["/home/o'brien/x", 'C:\\new "one"', "'", '1', 'true', 'ä b: {c} #', 'a\nb\t', '']
    given = {f'text_{place}': text for place, text in enumerate(texts)} | {'n': 2}
    context = rclpy.Context()
    rclpy.init(args=['x', *build_node_arguments('/a/b', given)], context=context)
    try:
        node = Node('b', namespace='a', context=context, start_parameter_services=False)
        for name, value in given.items():
            default = 1 if name == 'n' else 'none'
            assert node.declare_parameter(name, default).value == value
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
