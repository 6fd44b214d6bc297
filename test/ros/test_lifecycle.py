# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The life of a node: its transitions, its saved content, what it prepares, and its log; its end
during a write, with clients, in a compilation, and with middleware that hangs.
"""

import os
import signal
import subprocess
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from concurrent.futures import TimeoutError as FuturesTimeout
from contextlib import contextmanager

import pytest
import rclpy
from nodes import QUICK, check_closed, element_file, node_parameters, program
from robot import Robot
from suite import TIMEOUT_S

from mlmem_ros import standalone
from mlmem_ros.host import host, store
from mlmem_ros.ros.node import run
from mlmem_ros.ros.node_process import build_node_arguments


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


def test_end_answers_all_requests_and_closes_the_session(start_robot, tmp_path):
    """In the middle of a write."""
    bag, robot = tmp_path / 'session', start_robot()
    robot.set(write__method='strain', time__speed=0.025, record__path=str(bag))
    assert robot.trigger('record', data=True).success
    waiting = [robot.begin_strained_write(1)]
    robot.pause(True)  # from here on no tick begins, so no request is accepted or rejected
    waiting += [robot.send('write') for _ in range(8)]  # a service keeps the last ten
    for _ in waiting:
        robot.pause(True)  # an executor takes one of each service at a time
    assert not any(future.done() for future in waiting)
    robot.memory.terminate()
    answers = [robot.answer(future) for future in waiting]
    assert not any(answer.success for answer in answers)
    assert all(answer['error'] for answer in answers)
    assert robot.memory.exit_status() == run.ENDED
    assert 'Traceback' not in robot.memory.output
    assert '[ERROR]' not in robot.memory.output
    topics = {topic.rpartition('/')[2] for topic, _, _ in check_closed(bag)}
    assert {'joint_states', 'outcome'} <= topics


@pytest.mark.parametrize('longest', [0.8, 600.0])
def test_linger_ends_with_its_time_or_sigterm(longest):
    assert longest > run.CLIENT_ABSENCE_S  # or it would end for want of clients
    stop = [signal.SIGINT]
    with Robot() as robot:
        given = build_node_arguments('/mlmem', node_parameters({**QUICK, 'linger': longest}))
        nodes, executor = run.start_nodes(given, rclpy.Context())
        answer = robot.send('read')
        robot.wait(lambda: nodes[0].client_count, 'a client')
        begun = time.monotonic()
        lingers = threading.Thread(target=run.await_last_clients, args=(nodes, executor, stop))
        lingers.start()
        if longest > TIMEOUT_S:
            assert robot.answer(answer).success
            assert lingers.is_alive()
            stop.append(signal.SIGTERM)
        lingers.join(TIMEOUT_S)
        assert not lingers.is_alive()
        assert longest > TIMEOUT_S or time.monotonic() - begun > longest
        assert nodes[0].client_count
        assert run.end_nodes(nodes, executor) == 0


@contextmanager
def started(line, *command, **environment):
    """Run a program that starts a node until a line of its log; yield it."""
    process = program(
        *command, *build_node_arguments('/mlmem', QUICK), stderr=subprocess.PIPE,
        text=True, env=os.environ | environment,
    )  # fmt: skip
    try:
        assert any(line in each for each in process.stderr)
        yield process
    finally:
        process.kill()
        process.communicate()


def test_signal_ends_a_compilation(tmp_path):
    """Launch kills what goes on 15 s after SIGINT, as a compilation next to other work does."""
    folder = {'NUMBA_CACHE_DIR': str(tmp_path)}
    with started('compiling the kernels', '-m', 'mlmem_ros.ros.main', **folder) as process:
        process.send_signal(signal.SIGINT)
        process.send_signal(signal.SIGINT)
        output = process.stderr.read()
        assert process.wait() == 0, output
    assert 'compiled in' not in output
    assert 'shut down' in output
    assert 'Traceback' not in output


HANGS = """
import ctypes, sys
from mlmem_ros.ros import main
from mlmem_ros.ros.node import node, run
run.LEAVE_TIMEOUT_S = 0.5
hang = ctypes.PyDLL(None).sleep  # which keeps the GIL
node.MemoryNode.destroy_node = lambda self: hang(600)
node.Host.lost = True
spin_nodes = run.spin_nodes

def spin_with_notice(*given):
    print('spinning', file=sys.stderr, flush=True)
    spin_nodes(*given)

run.spin_nodes = spin_with_notice
sys.argv += ['-p', 'autostart:=false']  # without a device, which takes half as long to start
sys.exit(main.main())
"""


def test_middleware_that_hangs_at_the_end_is_cut_off():
    """With a traceback, and another status than one of a node that did not save: all is saved."""
    with started('spinning', '-c', HANGS) as process:
        process.send_signal(signal.SIGTERM)
        output = process.stderr.read()
        assert process.wait(TIMEOUT_S) == 1  # it hangs for longer
    assert 'Timeout' in output.partition('shut down')[2]
    assert 'in end' in output
