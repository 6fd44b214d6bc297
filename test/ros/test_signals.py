# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Ctrl-C and SIGTERM during a write: every request is answered, the session is closed."""

import os
import signal
import subprocess
import time
from contextlib import contextmanager

import pytest
from closed_bag import check_closed
from nodes import QUICK, program
from robot import Robot
from timeouts import TIMEOUT_S

from mlmem_ros.ros.node_process import build_node_arguments


@pytest.fixture
def recording(start, tmp_path):
    """A node that records, whose writes take 1.5 s."""
    bag = tmp_path / 'session'
    given = {'record.path': str(bag), 'write.method': 'strain', 'scale.time': 4e-4}
    node = start(given, apart=True)
    yield node
    assert node.exit_status() == 0
    assert 'Traceback' not in node.output
    assert '[ERROR]' not in node.output
    topics = {topic.rpartition('/')[2]: message for topic, _, message in check_closed(bag)}
    assert {'joint_states', 'outcome'} <= set(topics)


def test_ctrl_c_answers_all_requests_and_closes_the_session(recording):
    with Robot() as robot:
        waiting = [robot.begin_strained_write(1)]
        robot.pause(True)  # from here on no tick begins, so no request is accepted or rejected
        waiting += [robot.send('write') for _ in range(8)]  # a service keeps the last ten
        for _ in waiting:
            robot.pause(True)  # an executor takes one of each service at a time
        assert not any(future.done() for future in waiting)
        while recording.running:  # from the terminal, from launch, from an impatient user
            recording.signal(signal.SIGINT)
            time.sleep(0.01)
        answers = [robot.answer(future) for future in waiting]
    assert not any(answer.success for answer in answers)
    assert all(answer['error'] for answer in answers)


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
sys.exit(main.main())
"""


def test_middleware_that_hangs_at_the_end_is_cut_off():
    """With a traceback, and another status than one of a node that did not save: all is saved."""
    with started('ready', '-c', HANGS) as process:
        process.send_signal(signal.SIGTERM)
        output = process.stderr.read()
        assert process.wait(TIMEOUT_S) == 1  # it hangs for longer
    assert 'Timeout' in output.partition('shut down')[2]
    assert 'in end' in output
