# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The managed node: its transitions, its saved content, what it prepares, and its log."""

import threading
from concurrent.futures import ThreadPoolExecutor
from concurrent.futures import TimeoutError as FuturesTimeout

import pytest
from nodes import element_file
from timeouts import TIMEOUT_S

from mlmem_ros import standalone
from mlmem_ros.host import host, store


def test_managed_node_passes_through_its_states(start_robot):
    robot = start_robot({'autostart': False}, name='plain')
    assert robot.state == 'unconfigured'
    robot.set(target_level=1)
    for service in ('write', 'read', 'erase', 'calibrate', 'abort', 'step'):
        assert robot.trigger(service)['error_code'] == 'inactive'
    served = robot.node.get_service_names_and_types()
    assert not [name for name, _ in served if name.startswith('/plain/') and 'send_goal' in name]
    tested = robot.call('self_test')
    assert (tested.passed, len(tested.status)) == (b'\0', 1)
    assert 'inactive' in tested.status[0].message
    robot.change_state('configure')
    assert 'unconfigured' in robot.try_set('element', 'bits_2').reason
    assert 'inactive' in robot.trigger('read')['error']
    robot.change_state('activate')
    assert robot.state == 'active'
    assert robot.write(1)['level'] == 1
    robot.change_state('deactivate')
    assert 'inactive' in robot.trigger('read')['error']
    robot.change_state('activate')
    assert robot.trigger('read')['level'] == 1  # held in between
    robot.change_state('deactivate', 'cleanup')
    assert robot.state == 'unconfigured'
    short = element_file('bits_2', {'design.N': 60})  # shorter than a level and the tail
    assert 'N - tail' in robot.try_set('element', short).reason
    robot.set(element='bits_2')
    robot.change_state('configure')


def test_content_is_saved_at_intervals(start_robot, tmp_path):
    """Also what changes without a write: here the number of ticks."""
    file = tmp_path / 'element.json'
    robot = start_robot({'state.path': str(file), 'state.interval': 0.2})
    assert robot.write(0)['level'] == 0
    ticks = store.load_snapshot(file)['ticks']
    robot.wait(lambda: store.load_snapshot(file)['ticks'] > ticks, 'a later state')
    assert store.load_snapshot(file)['reading']['level'] == 0


def test_design_that_fails_its_check_is_rejected_or_named(start_robot):
    """The gradient is weak: the lattice may stop the wall, but a calibration works."""
    robot = start_robot({'autostart': False, 'element': 'case_2', 'design.check': 'refuse'})
    robot.set(element=element_file('case_2', {'design.gamma': -6e-5}))
    assert not robot.response(robot.request_transition('configure')).success
    assert 'cannot configure: the design fails its check (peierls_nabarro' in robot.memory.output
    assert 'mlmem design check' in robot.memory.output
    assert not robot.try_set('design.check', 'perhaps').successful
    robot.set(design__check='warn')
    robot.change_state('configure')
    assert 'design check: peierls_nabarro' in robot.memory.output


@pytest.fixture
def slow_build(monkeypatch):
    """Let a device take a time to build, as with a cold cache; return what lets it go on."""
    built, go_on = host.build_device, threading.Event()

    def build(*arguments):
        assert go_on.wait(TIMEOUT_S)
        return built(*arguments)

    monkeypatch.setattr(host, 'build_device', build)
    yield go_on
    go_on.set()


def test_preparing_node_answers_get_state_at_once(start_robot, slow_build):
    """nav2's lifecycle manager waits 5 s for the state; kernels take longer to compile."""
    robot = start_robot({'autostart': False})
    configured = robot.request_transition('configure')
    assert robot.state == 'unconfigured'
    assert not configured.done()
    slow_build.set()
    assert robot.response(configured).success
    assert robot.state == 'inactive'


def test_request_to_a_preparing_node_waits(start, slow_build, capfd):
    """Longer than its time-out; the first request to hear of it says what all wait for."""
    with standalone(patience=TIMEOUT_S) as memory, ThreadPoolExecutor() as threads:
        starting = threads.submit(start)
        memory.ready(TIMEOUT_S).wait()  # its services are there
        read = memory.read(timeout=2.0)
        with pytest.raises(FuturesTimeout):
            read.result(4.0)
        slow_build.set()
        assert read.wait().level == -1
        starting.result()
    assert 'waits for /mlmem: preparing the device' in capfd.readouterr().err
