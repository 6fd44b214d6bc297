# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A node over an emulated rig: what it reports, records, and does when the rig restarts.

test_contract.py has the whole contract over a rig in another process, as slow tests.
"""

import contextlib
import socket
import threading
import time
from concurrent.futures import Future
from dataclasses import replace
from types import SimpleNamespace
from unittest.mock import MagicMock

import pytest
from nodes import QUICK
from robot import Robot, values

from mlmem import DriverError, DriverHangs, preset
from mlmem.instrument.drivers import Simulation
from mlmem_ros.bag.errors import BagError
from mlmem_ros.bag.reader import BagReader
from mlmem_ros.ros.node import node as node_module
from mlmem_ros.ros.node.starting import Retries
from mlmem_ros.session.data import load_session
from mlmem_ros.session.replay import run_replay
from mlmem_tools.rig.emulated import EmulatedRig, LineProperties, Server

UNKNOWN = -2
DESIGN, SETTINGS = preset(QUICK['element'])
FAST = replace(SETTINGS, scale=replace(SETTINGS.scale, time=QUICK['scale.time']))


@pytest.fixture
def server():
    """Serve a rig in a thread."""
    server = Server(
        EmulatedRig(DESIGN, SETTINGS), LineProperties(latency=0.002, jitter=0.003, loss=0.002)
    )
    thread = threading.Thread(target=server.run)
    thread.start()
    yield server
    server.close()
    thread.join()


def test_node_over_a_rig_writes_records_and_reconnects(server, start, tmp_path):
    state = tmp_path / 'state.json'
    given = {
        'device.driver': 'rig',
        'device.address': f'tcp://127.0.0.1:{server.port}?lead=0.2&patience=10',
        'scale.time': SETTINGS.scale.time,
        'record.path': str(tmp_path / 'bag'),
        'state.path': str(state),
    }
    node = start(given)
    with Robot(node.element) as robot:
        written = robot.write(1)
        assert (written.success, written['level']) == (True, 1)
        assert robot.trigger('read')['level'] == 1
        for topic in ('field', 'wall', 'image', 'markers'):
            assert not robot.node.get_publishers_info_by_topic(robot.name(topic))
        refused = robot.try_set('device.driver', 'sim')
        assert 'only while the node is unconfigured' in refused.reason
        assert len(robot.next('joint_states').effort) == 2  # this rig measures its force
        robot.next('/diagnostics', lambda report: 'rig' in values(told_of(report, 'material')))
        robot.set(target_level=2)
        answer = robot.send('write')
        robot.wait(lambda: asked(node, lambda element: element.procedure), 'the write')
        server.restart()
        refused = robot.answer(answer)
        assert not refused.success
        assert 'the device has stopped: ' in refused['error']

        robot.wait(lambda: robot.state == 'unconfigured', 'the node unconfigured')
        told = robot.next('/diagnostics', lambda report: told_of(report, 'loop').level == b'\2')
        assert told_of(told, 'loop').message.startswith('the device has stopped: tcp://127.0.0.1')
        refused = robot.try_set('device.driver', 'this:Zen')
        assert 'must be one of sim, rig; got ' in (refused.reason)
        robot.change_state('configure', 'activate')
        assert robot.latest('level', lambda level: level.data == UNKNOWN)
        assert robot.write(0)['level'] == 0
    assert 'its content is in the element' in node.output
    assert f'calibration and statistics restored from {state}' in node.output
    assert server.clients == 2
    check_session(tmp_path / 'bag')


def asked(node, question):
    """Return what a function of a node's element returns, in the thread that runs it."""
    host = node.node.host
    return host.loop.call(lambda: question(host.element)).result()


def told_of(report, component):
    """Return the status of a component."""
    (status,) = [each for each in report.status if each.name.endswith(f': {component}')]
    return status


def check_session(bag):
    """Assert that the echoes have levels, and that a replay is refused."""
    session = load_session(bag)
    assert session.hashes == []
    assert not {'/mlmem/field', '/mlmem/wall'} & set(BagReader(bag).topics)
    with pytest.raises(BagError, match='a session of a real element cannot be replayed'):
        run_replay(session)
    assert len(session.echoes) >= 3
    assert {echo.content for echo in session.echoes} >= {1}


@contextlib.contextmanager
def rig_at(port, element):
    """Serve an element at a port, which may have been in use until now."""
    server = Server(EmulatedRig(DESIGN, FAST, element, at_once=True), LineProperties(), port=port)
    thread = threading.Thread(target=server.run)
    thread.start()
    try:
        yield server
    finally:
        server.restart()
        server.close()
        thread.join()


def test_rig_that_was_off_or_lost_is_taken_back(start, monkeypatch):
    """At the start, and after it was lost with its line; the element keeps its content."""
    monkeypatch.setattr(node_module, 'CHECK_PERIOD_S', 0.05)
    with socket.create_server(('127.0.0.1', 0)) as free:
        port = free.getsockname()[1]
    element = Simulation.of(DESIGN, FAST.time)
    node = start({
        'device.driver': 'rig', 'device.retry': 0.1,
        'device.address': f'tcp://127.0.0.1:{port}?lead=0.002&patience=10',
    })  # fmt: skip

    def loop(level, text):
        def fits(report):
            told = told_of(report, 'loop')
            return told.level == level and told.message.startswith(text)

        robot.next('/diagnostics', fits)

    def active():
        return robot.state == 'active'

    with Robot(node.element) as robot:
        loop(b'\2', 'waiting for the element since ')
        assert 'waiting for the element' in robot.trigger('read')['error']
        with rig_at(port, element):
            robot.wait(active, 'the node active')
            assert robot.write(0)['level'] == 0
            assert asked(node, lambda element: element.statistics.writes) == 1
        loop(b'\2', 'waiting for the element since ')
        assert not active()
        with rig_at(port, element) as server:
            robot.wait(active, 'the node active again')
            assert robot.trigger('read')['level'] == 0
            assert asked(node, lambda element: element.statistics.writes) == 1
            assert server.clients == 1
            robot.change_state('deactivate', 'cleanup')
            loop(b'\0', 'inactive')  # as was asked: nothing is waited for
            assert not active()
    assert node.output.count('the element is back after ') == 2
    assert node.output.count('preparing the device') == 1  # not at every attempt


def test_node_answers_while_it_tries_to_reach_a_rig(start, monkeypatch):
    """A rig that takes the line and says nothing holds up each attempt."""
    monkeypatch.setattr(node_module, 'CHECK_PERIOD_S', 0.05)
    with socket.create_server(('127.0.0.1', 0)) as free:
        address = free.getsockname()
    node = start({
        'device.driver': 'rig', 'device.retry': 0.1,
        'device.address': f'tcp://127.0.0.1:{address[1]}?lead=0.002&patience=5',
    })  # fmt: skip
    with Robot(node.element) as robot:
        assert robot.state
        with socket.create_server(address) as silent, silent.accept()[0]:
            begun = time.monotonic()
            assert robot.state
            assert time.monotonic() - begun < 2.5  # half the time that the attempt takes


def test_wrong_address_of_a_rig_ends_the_start(refused):
    """Settings that are wrong stay so; and without the setting nothing is waited for."""
    given = {'device.driver': 'rig', 'device.retry': 1.0}
    assert 'device.address of a rig must be' in refused(given | {'device.address': 'slot 2'})


def test_start_without_a_rig_fails(refused):
    line = refused({'device.driver': 'rig', 'device.address': 'tcp://127.0.0.1:1'})
    assert 'cannot start: no rig at tcp://127.0.0.1:1: Connection refused' in line


class Waiting:
    """A node that waits for its element: every start ends as given."""

    unconfigured = True

    def __init__(self, *ends):
        self.ends, self.starts = list(ends), 0

    def prepare(self):
        prepared = Future()
        prepared.set_result(None)
        return prepared

    def start(self):
        self.starts += 1
        if end := self.ends.pop(0):
            raise end


def waiting(*ends):
    """Return such a node, the host's log, and its retries without pauses."""
    node, host = Waiting(*ends), SimpleNamespace(log=MagicMock(), stopped='')
    return node, host, Retries(node, host, lambda: 1e-9)


def test_driver_that_hangs_on_a_retry_is_given_up():
    node, host, retries = waiting(DriverError('off'), DriverHangs('opening takes too long'))
    assert retries.begin(DriverError('lost'))
    for _ in range(4):
        retries.on_timer()
    assert node.starts == 2
    assert not retries.waiting
    host.log.error.assert_called_once()
