# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A node over an emulated rig: what it reports, records, and does when the rig restarts.

test_contract.py has the whole contract over a rig in another process, as slow tests.
"""

import socket
from dataclasses import replace

import pytest
from lines import PatientRig, serving
from nodes import QUICK
from robot import values
from suite import TIMEOUT_S

from mlmem import UNDECODABLE, DriverError, DriverHangs, load_element
from mlmem_ros.bag.errors import BagError
from mlmem_ros.bag.reader import BagReader
from mlmem_ros.ros.client.client import wait_until
from mlmem_ros.ros.node import node as node_module
from mlmem_ros.session.data import load_session
from mlmem_ros.session.replay import run_replay
from mlmem_tools.rig.emulated import EmulatedRig, LineProperties

DESIGN, SETTINGS = load_element(QUICK['element']).design_and_settings
FAST = replace(SETTINGS, scale=replace(SETTINGS.scale, time=QUICK['scale.time']))


def test_node_over_a_rig_writes_records_and_reconnects(start_robot, tmp_path):
    line = LineProperties(latency=0.002, jitter=0.003, loss=0.002)
    rig = PatientRig(DESIGN, FAST)
    with serving(rig, line) as server:
        robot = start_robot({
            'device.driver': 'rig',
            'device.address': f'tcp://127.0.0.1:{server.port}?lead=0.02&patience=10',
            'record.path': str(tmp_path / 'bag'),
            'state.path': str(tmp_path / 'state.json'),
        })  # fmt: skip
        assert robot.write(1)['level'] == 1
        assert robot.trigger('read')['level'] == 1
        for topic in ('field', 'wall', 'image', 'markers'):
            assert not robot.node.get_publishers_info_by_topic(robot.name(topic))
        assert not robot.try_set('device.driver', 'sim').successful
        assert len(robot.next('joint_states').effort) == 2  # this rig measures its force
        robot.next_status('material', lambda status: 'rig' in values(status))
        pass_time = rig.pass_time

        def fail_in_a_write(seconds):  # as a server that restarts loses its client
            if robot.memory.node.host.element.procedure:
                rig.pass_time = pass_time
                raise OSError('restarted')
            return pass_time(seconds)

        rig.pass_time = fail_in_a_write
        assert 'the device has stopped: ' in robot.write(2)['error']

        robot.wait(lambda: robot.state == 'unconfigured', 'the node unconfigured')
        stopped = robot.next_status('loop', lambda status: status.level == b'\2')
        assert 'tcp://127.0.0.1' in stopped.message
        assert not robot.try_set('device.driver', 'this:Zen').successful
        robot.change_state('configure', 'activate')
        assert robot.latest('level', lambda level: level.data == UNDECODABLE)
        assert robot.write(0)['level'] == 0
        assert 'its content is in the element' in robot.memory.output
        assert 'calibration and statistics restored from' in robot.memory.output
        assert server.clients == 2
    session = load_session(tmp_path / 'bag')
    assert session.hashes == []
    assert not {'/mlmem/field', '/mlmem/wall'} & set(BagReader(tmp_path / 'bag').topics)
    with pytest.raises(BagError, match='a session of a real element cannot be replayed'):
        run_replay(session)
    assert len(session.events['echo']) >= 3
    assert any(values.get('level') == '1' for _, values in session.outcomes)


def test_rig_that_was_off_or_lost_is_taken_back(start_robot, monkeypatch):
    """At the start, and after it was lost with its line; the element keeps its content."""
    monkeypatch.setattr(node_module, 'CHECK_PERIOD_S', 0.05)
    with socket.create_server(('127.0.0.1', 0)) as free:
        port = free.getsockname()[1]
    rig = EmulatedRig(DESIGN, FAST, at_once=True)
    robot = start_robot({
        'device.driver': 'rig', 'device.retry': 0.1,
        'device.address': f'tcp://127.0.0.1:{port}?lead=0.002&patience=10',
    })  # fmt: skip
    host = robot.memory.node.host

    def wait_for_status(level, text):
        robot.next_status(
            'loop', lambda status: status.level == level and status.message.startswith(text)
        )

    def is_active():
        return robot.state == 'active'

    def count_writes():
        return host.loop.call(lambda: host.element.statistics.writes).result()

    wait_for_status(b'\2', 'waiting for the element since ')
    assert 'waiting for the element' in robot.trigger('read')['error']
    with serving(rig, port=port):
        robot.wait(is_active, 'the node active')
        assert robot.write(0)['level'] == 0
        assert count_writes() == 1
    wait_for_status(b'\2', 'waiting for the element since ')
    assert not is_active()
    with serving(rig, port=port) as server:
        robot.wait(is_active, 'the node active again')
        assert robot.trigger('read')['level'] == 0
        assert count_writes() == 1
        assert server.clients == 1
        robot.change_state('deactivate', 'cleanup')
        wait_for_status(b'\0', 'inactive')  # as was requested: nothing is waited for
        assert not is_active()
    assert robot.memory.output.count('the element is back after ') == 2
    assert robot.memory.output.count('preparing the device') == 1  # not at every attempt


def test_driver_that_hangs_on_a_retry_is_given_up(start, monkeypatch):
    monkeypatch.setattr(node_module, 'CHECK_PERIOD_S', 0.05)
    errors = iter([DriverError('off'), DriverError('off'), DriverHangs('opening takes too long')])

    def open_driver(*_):
        raise next(errors)

    monkeypatch.setattr('mlmem_ros.host.building.open_driver', open_driver)
    node = start({'device.driver': 'rig', 'device.retry': 0.1})
    given_up = 'the element is back, but cannot be started: opening takes too long'
    wait_until(lambda: given_up in node.output, 'the end of the attempts', TIMEOUT_S)
    assert next(errors, None) is None
