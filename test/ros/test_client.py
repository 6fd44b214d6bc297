# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The client as robots use it: awaited in callbacks, waited for elsewhere, over real DDS."""

import asyncio
import threading
import time
from concurrent import futures

import numpy as np
import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticStatus
from nodes import run_in_executor
from rclpy.executors import SingleThreadedExecutor
from rclpy.task import Future
from suite import TIMEOUT_S

from mlmem_ros import MemoryClient, NoAnswer, RequestRefused
from mlmem_ros.ros.client.reply import create_suspension


@pytest.fixture
def node(create_node, client):
    """A robot's node, in no executor, next to the running memory."""
    return create_node('behaviour')


def test_client_without_actions_gets_the_same_answer(client, memory):
    plain = MemoryClient(client.node, memory.element, actions=False)
    written = client.write(2).wait()
    assert plain.read().wait().level == written.level == 2
    for each in (plain, client):
        assert each.read(end='right').wait().end == 'right'
    assert set(plain.write(2).wait().details) <= {*written.details, 'asked'}
    read = plain.read()
    assert not read.cancel_goal()
    read.wait()
    with pytest.raises(StopAsyncIteration):  # no progress is reported
        aiter(read).__anext__().send(None)


def test_number_is_converted_to_the_type_of_its_field(client):
    assert client.write(np.int64(2), timeout=int(TIMEOUT_S)).wait().level == 2
    assert client.procedure('write', int(TIMEOUT_S), level=np.int64(3)).wait().level == 3
    for speed, seed in ((2, 3), (np.float32(2.0), np.int64(3))):
        client.set_parameters({'time.speed': speed, 'faults.seed': seed}).wait()
        expected = {'time.speed': 2.0, 'faults.seed': 3}
        assert client.parameters(*expected).wait() == expected
        client.set_parameters({'time.speed': 1, 'faults.seed': 0}).wait()


def test_unknown_parameter_is_rejected(client):
    with pytest.raises(RequestRefused, match=r'design\.nothing'):
        client.parameters('element', 'design.nothing').wait()


def test_wait_works_though_nobody_spins_its_node(node, context):
    client, idle = MemoryClient(node, '/mlmem'), SingleThreadedExecutor(context=context)
    assert client.write(4, timeout=TIMEOUT_S).wait().level == 4
    assert node.executor is None  # left as it was: rclpy.spin(node) may follow
    rclpy.spin_once(node, executor=idle, timeout_sec=0.0)
    assert node.executor is idle
    assert client.read(timeout=TIMEOUT_S).wait().level == 4


@pytest.mark.parametrize('blocks', [True, False])
def test_callback_gets_its_answer_and_is_called_with_it(node, context, blocks):
    """Whether it blocks the only thread of its executor or awaits the answer."""
    client, executor = MemoryClient(node, '/mlmem'), SingleThreadedExecutor(context=context)
    called = Future()

    def keep_result(reply):
        called.set_result((reply.result().attempts, threading.current_thread()))

    async def read():
        reply = client.read()
        reply.add_done_callback(keep_result)
        return reply.wait() if blocks else await reply

    assert run_in_executor(node, executor, read).attempts == 1
    executor.spin_until_future_complete(called, TIMEOUT_S)
    assert called.done()
    assert called.result() == (1, threading.current_thread())


def test_coroutine_of_an_executor_awaits_a_future_of_rclpy(node):
    """The tasks of rclpy 7.1.9 and later resume after no other."""
    waiting, resume = create_suspension(node)
    assert isinstance(waiting, Future)
    resume(None)
    assert waiting.done()


def test_callback_of_another_executor_gets_its_answer(client, create_node, context):
    """The tasks of rclpy 7.1.9 and later await no future that belongs to another executor."""
    node, executor = create_node('other'), SingleThreadedExecutor(context=context)
    wakes = {'callback': lambda: None, 'callback_group': client.group}
    node.create_timer(0.01, **wakes)  # by which earlier ones resume
    assert node.executor is not client.node.executor
    assert run_in_executor(node, executor, client.read).attempts == 1


@pytest.mark.parametrize('own', [True, False], ids=['own thread', 'of a node'])
def test_asyncio_awaits_without_a_spinning_node(node, client, own, monkeypatch):
    memory, beats = client if own else MemoryClient(node, '/mlmem'), []
    timers = []  # which wake executors of rclpy: a hundred answers at once flooded the log
    monkeypatch.setattr(memory.node, 'create_timer', lambda *given, **_: timers.append(given))

    async def beat():
        while True:
            beats.append(None)
            await asyncio.sleep(0.001)

    async def write_and_read():
        beating = asyncio.create_task(beat())
        await memory.pause()
        writing = asyncio.ensure_future(memory.write(4, timeout=TIMEOUT_S))
        while len(beats) < 10:  # others run meanwhile
            await asyncio.sleep(0.001)
        assert not writing.done()
        await memory.pause(False)
        await writing
        content, values = await asyncio.gather(memory.read(), memory.parameters('write.method'))
        beating.cancel()
        with pytest.raises(asyncio.TimeoutError):
            await asyncio.wait_for(asyncio.ensure_future(memory.calibrate()), 0.05)
        return content.level, values

    found = asyncio.run(asyncio.wait_for(write_and_read(), TIMEOUT_S))
    assert found == (4, {'write.method': 'kick'})
    assert not timers
    client.abort().wait()


def test_answer_comes_though_its_node_was_destroyed(node):
    reply = MemoryClient(node, '/mlmem').read()
    node.destroy_node()
    assert reply.wait().attempts == 1


def test_thread_of_a_lost_node_ends_with_its_last_request(node, context):
    """One for each time that the memory node stood still would add up."""
    client, threads = MemoryClient(node, '/nobody', patience=0.2), []
    for _ in range(4):
        reply = client.read()
        threads.append(reply.link.thread)
        reply.link._came_back = True
        with pytest.raises(NoAnswer):
            reply.wait()
    for thread in threads[1:-1]:
        thread.join(TIMEOUT_S)
    assert [thread.is_alive() for thread in threads] == [True, False, False, True]
    rclpy.shutdown(context=context)
    for thread in threads:
        thread.join(TIMEOUT_S)
    assert not any(thread.is_alive() for thread in threads)


def test_wait_ends_with_its_context(node, context):
    client = MemoryClient(node, '/nobody')
    reply = client.write(0)
    rclpy.shutdown(context=context)
    with pytest.raises(NoAnswer, match='during write 0'):
        reply.wait()
    for request in (client.ready, client.read, client.pause):
        with pytest.raises(NoAnswer, match='/nobody: '):
            request().result(TIMEOUT_S)


@pytest.mark.parametrize(
    ('send', 'field'),
    [
        (lambda client: client.write(2.5), 'level'),
        (lambda client: client.write(-1), 'level'),
        (lambda client: client.request('write', level=2.5), 'level'),
        (lambda client: client.request('explode'), 'request'),
        (lambda client: client.request('write', levl=3), 'write: there is no'),
        (lambda client: client.read(timeout=float('nan')), 'timeout'),
        (lambda client: client.read(timeout=0), 'timeout'),
        (lambda client: client.read(end=3), 'end'),
        (lambda client: client.record(path=3), 'path'),
        (lambda client: client.set_parameters({'faults.seed': {}}), r'faults\.seed'),
        (lambda client: client.set_parameters({'faults.seed': 2**63}), r'faults\.seed'),
    ],
)
@pytest.mark.parametrize('actions', [True, False])
def test_argument_that_no_message_holds_is_not_sent(client, actions, send, field):
    with pytest.raises(ValueError, match=f'^{field}'):
        send(MemoryClient(client.node, '/mlmem', actions=actions))


def test_reply_may_be_cancelled_twice(client):
    reply = MemoryClient(client.node, '/nobody').read()
    assert [reply.cancel(), reply.cancel()] == [True, True]
    assert not futures.wait([reply], TIMEOUT_S).not_done
    with pytest.raises(futures.CancelledError):
        reply.wait()
    ended = client.read()
    ended.wait()
    assert not ended.cancel()


def test_request_ends_though_the_node_died_while_it_prepared(client):
    """Its last heartbeat says for ever that the time does not count."""
    reply = MemoryClient(client.node, '/nobody', patience=0.2).read()
    reply.link.status = DiagnosticStatus(level=DiagnosticStatus.STALE)
    reply.link._last_sign = time.monotonic() - 5.0
    with pytest.raises(NoAnswer, match='no memory node answers'):
        reply.result(TIMEOUT_S)


def test_client_names_are_relative_to_its_namespace(create_node):
    node = create_node('arm', namespace='/robot')
    assert MemoryClient(node).name == '/robot/mlmem'
    assert MemoryClient(node, 'left/mlmem').name == '/robot/left/mlmem'
    assert MemoryClient(node, '/mlmem').name == '/mlmem'
