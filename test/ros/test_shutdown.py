# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Ctrl-C and SIGTERM, also during a write, a robot and its memory that are stopped together, and a
memory that stood still.
"""

import os
import re
import signal
import subprocess
import threading
import time
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest
import rclpy
from nodes import QUICK, program
from robot import Robot
from timeouts import TIMEOUT_S

from mlmem_ros import MemoryClient, NoAnswer, standalone
from mlmem_ros.host import store
from mlmem_ros.ros.client.client import wait_until
from mlmem_ros.ros.node.run import CLIENT_ABSENCE_S, await_last_clients, end_nodes, start_nodes
from mlmem_ros.ros.node_process import build_node_arguments

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope='module')
def lasting(start_shared, tmp_path_factory):
    """A node that serves its clients longer than itself, and its state file."""
    state = tmp_path_factory.mktemp('lasting') / 'state.json'
    return start_shared({'linger': 600.0, 'state.path': str(state)}, apart=True), state


def test_node_that_stood_still_answers_again(lasting, create_node):
    """Half of them used to be forgotten for good: of those who ask meanwhile, and of others."""
    node, _ = lasting
    with ExitStack() as stack:
        clients = [stack.enter_context(standalone()) for _ in range(4)]
        clients.append(MemoryClient(create_node('behaviour'), '/mlmem'))
        for memory in clients:
            memory.ready(TIMEOUT_S).wait()
            memory.read().wait()
        node.signal(signal.SIGSTOP)
        begun = time.monotonic()
        for reading in [memory.read(timeout=600.0) for memory in clients[::2]]:
            with pytest.raises(NoAnswer, match='went away during read: how it ended is not known'):
                reading.result(TIMEOUT_S)  # while it stands still
        time.sleep(max(0.0, begun + 6.0 - time.monotonic()))
        node.signal(signal.SIGCONT)
        assert [memory.request('read').wait().details['level'] for memory in clients] == [-1] * 5


def test_robot_stopped_with_its_memory_writes_once_more(lasting, tmp_path):
    """The program printed in docs/robot.md."""
    node, state = lasting
    blocks = re.findall(
        r'```python\n(.*?)```', (ROOT / 'docs' / 'robot.md').read_text(), re.DOTALL
    )
    behaviour = tmp_path / 'behaviour.py'
    assert 'timeout=3.0' in blocks[1]
    blocks[1] = blocks[1].replace('timeout=3.0', f'timeout={TIMEOUT_S}')  # on a busy machine
    behaviour.write_text('\n'.join([*blocks, 'main()\n']))
    with standalone() as memory:
        memory.ready(TIMEOUT_S).wait()  # on a busy machine it starts late
        assert memory.write(5, timeout=TIMEOUT_S).wait().level == 5
    reads = node.output.count('read succeeded')
    robot = program(behaviour, stderr=subprocess.PIPE, text=True)
    wait_until(
        lambda: node.output.count('read succeeded') > reads, "its constructor's read", TIMEOUT_S
    )
    for _ in range(3):  # as a terminal does, and again, as launch does
        node.signal(signal.SIGINT)
        robot.send_signal(signal.SIGINT)
        time.sleep(0.003)
    assert (robot.wait(TIMEOUT_S), robot.stderr.read()) == (0, '')
    assert node.exit_status(TIMEOUT_S) == 0  # it does not linger to the end
    assert store.load_snapshot(state)['reading']['level'] == 0


@pytest.mark.parametrize('longest', [0.8, 600.0])
def test_linger_ends_with_its_time_or_sigterm(longest):
    assert longest > CLIENT_ABSENCE_S  # or it would end for want of clients
    stop = [signal.SIGINT]
    with Robot() as robot:
        parameters = {**QUICK, 'linger': longest}
        nodes, executor = start_nodes(build_node_arguments('/mlmem', parameters), rclpy.Context())
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
sys.exit(main.main())
"""


def test_middleware_that_hangs_at_the_end_is_cut_off():
    """With a traceback, and another status than one of a node that did not save: all is saved."""
    with started('preparing the device', '-c', HANGS) as process:
        process.send_signal(signal.SIGTERM)
        output = process.stderr.read()
        assert process.wait(TIMEOUT_S) == 1  # it hangs for longer
    assert 'Timeout' in output.partition('shut down')[2]
    assert 'in end' in output
