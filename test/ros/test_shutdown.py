# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A robot and its memory that are stopped together, and a memory that is killed."""

import re
import signal
import subprocess
import threading
import time
from contextlib import ExitStack
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


def test_robot_stopped_with_its_memory_writes_once_more(start, tmp_path):
    """The program printed in docs/robot.md."""
    blocks = re.findall(
        r'```python\n(.*?)```', (ROOT / 'docs' / 'robot.md').read_text(), re.DOTALL
    )
    behaviour, state = tmp_path / 'behaviour.py', tmp_path / 'state.json'
    assert 'timeout=3.0' in blocks[1]
    blocks[1] = blocks[1].replace('timeout=3.0', f'timeout={TIMEOUT_S}')  # on a busy machine
    behaviour.write_text('\n'.join([*blocks, 'main()\n']))
    node = start({'linger': 600.0, 'state.path': str(state)}, apart=True)
    with standalone() as memory:
        memory.ready(TIMEOUT_S).wait()  # on a busy machine it starts late
        assert memory.write(5, timeout=TIMEOUT_S).wait().level == 5
    robot = program(behaviour, stderr=subprocess.PIPE, text=True)
    wait_until(lambda: 'read succeeded' in node.output, 'the read of its constructor', TIMEOUT_S)
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
        assert robot.answer(answer).success
        if longest > TIMEOUT_S:
            assert lingers.is_alive()
            stop.append(signal.SIGTERM)
        lingers.join(TIMEOUT_S)
        assert not lingers.is_alive()
        assert longest > TIMEOUT_S or time.monotonic() - begun > longest
        assert nodes[0].client_count
        assert end_nodes(nodes, executor) == 0


def test_node_that_stood_still_answers_again(start, create_node):
    """Half of them used to be forgotten for good: of those who ask meanwhile, and of others."""
    node = start(apart=True)
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
