# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The end of a node: during a write, with clients, in a compilation, and with middleware that
hangs.
"""

import os
import signal
import subprocess
import threading
import time
from contextlib import contextmanager

import pytest
import rclpy
from nodes import QUICK, check_closed, node_parameters, program
from robot import Robot
from timeouts import TIMEOUT_S

from mlmem_ros.ros.node.run import (
    CLIENT_ABSENCE_S,
    ENDED,
    await_last_clients,
    end_nodes,
    start_nodes,
)
from mlmem_ros.ros.node_process import build_node_arguments


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
    assert robot.memory.exit_status() == ENDED
    assert 'Traceback' not in robot.memory.output
    assert '[ERROR]' not in robot.memory.output
    topics = {topic.rpartition('/')[2] for topic, _, _ in check_closed(bag)}
    assert {'joint_states', 'outcome'} <= topics


@pytest.mark.parametrize('longest', [0.8, 600.0])
def test_linger_ends_with_its_time_or_sigterm(longest):
    assert longest > CLIENT_ABSENCE_S  # or it would end for want of clients
    stop = [signal.SIGINT]
    with Robot() as robot:
        given = build_node_arguments('/mlmem', node_parameters({**QUICK, 'linger': longest}))
        nodes, executor = start_nodes(given, rclpy.Context())
        answer = robot.send('read')
        robot.wait(lambda: nodes[0].client_count, 'a client')
        begun = time.monotonic()
        lingers = threading.Thread(target=await_last_clients, args=(nodes, executor, stop))
        lingers.start()
        if longest > TIMEOUT_S:
            assert robot.answer(answer).success
            assert lingers.is_alive()
            stop.append(signal.SIGTERM)
        lingers.join(TIMEOUT_S)
        assert not lingers.is_alive()
        assert longest > TIMEOUT_S or time.monotonic() - begun > longest
        assert nodes[0].client_count
        assert end_nodes(nodes, executor) == 0


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
