# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The client as robots use it: awaited in callbacks, waited for elsewhere, over real DDS."""

import asyncio
import contextlib
import dataclasses
import gc
import subprocess
import sys
import threading
import time
from functools import partial

import numpy as np
import pytest
import rclpy
from nodes import SOON, arrived, refused
from rcl_interfaces.srv import SetParametersAtomically
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.parameter import Parameter
from rclpy.task import Future

from mlmem_ros import (
    Decoded,
    MemoryClient,
    NoAnswer,
    RequestError,
    RequestFailed,
    RequestRefused,
    standalone,
)
from mlmem_ros.ros.client import line
from mlmem_ros.ros.client.client import wait_until
from mlmem_ros.ros.client.link import Link
from mlmem_ros.ros.middleware import create_events_executor


@pytest.fixture(scope='module')
def given():
    return {'actions': True}


@pytest.fixture(scope='module')
def client(memory):
    """A client for a program without a node."""
    with standalone(memory.element) as client:
        client.ready(60).wait()
        yield client


@pytest.fixture
def node(context, memory, client):
    """A robot's node, in no executor, beside the running memory."""
    node = rclpy.create_node('behaviour', context=context, use_global_arguments=False)
    yield node
    node.destroy_node()


class StandIn:
    """A node in place of the memory that answers whatever a test chooses."""

    def __init__(self, context):
        self.node = rclpy.create_node('stand_in', context=context, use_global_arguments=False)
        self.answer = ''
        self.node.create_service(SetParametersAtomically, '~/request', self._answer)

    def _answer(self, _, response):
        response.result.successful = True
        response.result.reason = self.answer
        return response


@pytest.fixture
def stand_in(context):
    stand_in = StandIn(context)
    yield stand_in
    stand_in.node.destroy_node()


def in_a_callback(node, executor, action):
    """Run an action as a timer's callback of the node; return what it returns."""
    done = Future()

    async def callback():
        timer.cancel()
        try:
            done.set_result(await action())
        except Exception as error:
            done.set_exception(error)

    timer = node.create_timer(0.001, callback)
    executor.add_node(node)
    executor.spin_until_future_complete(done, SOON)
    assert done.done(), f'no answer within {SOON} s: a deadlock'
    return done.result()


@contextlib.contextmanager
def spinning(node):
    """Spin a node in its own thread, as many robots do."""
    executor, over = SingleThreadedExecutor(context=node.context), Future()
    executor.add_node(node)
    thread = threading.Thread(target=executor.spin_until_future_complete, args=(over,))
    thread.start()
    try:
        yield
    finally:
        over.set_result(None)
        thread.join(SOON)
        executor.shutdown()


# Waiting


def test_write_read_and_erase(client):
    written = client.write(3).wait()
    assert (written.level, written.code, written.blank) == (3, '011', False)
    read = client.read().wait()
    assert read == dataclasses.replace(
        written, delay=read.delay, right_delay=read.right_delay, attempts=1,
        level_margin=read.level_margin,
        threshold_margin=read.threshold_margin, confidence=read.confidence, ticks=read.ticks,
    )  # fmt: skip
    assert read.delay == pytest.approx(written.delay, abs=5.0)
    assert client.erase().wait().blank
    assert client.read().wait().level == -1


def test_a_self_test_reports_every_check_and_keeps_the_content(client):
    client.write(1).wait()
    tested = client.self_test().wait()
    assert tested.passed, tested.failed
    assert tested.failed == ()
    assert list(tested.checks)[3:] == ['erase', *(f'level {n}' for n in range(8)), 'restore']
    assert tested.checks['restore'] == 'level 1'
    assert float(tested.details['level 7']['confidence']) > 0.5
    assert client.read().wait().level == 1


def test_results_are_values(client):
    content = client.read().wait()
    assert isinstance(content, Decoded)
    assert content.details['procedure'] == 'read'
    assert hash(content) == hash(dataclasses.replace(content))
    with pytest.raises(dataclasses.FrozenInstanceError):
        content.level = 5


def test_time_is_paused_and_stepped(client):
    held = client.pause().wait()
    try:
        assert held.paused
        assert client.step().wait().tick == held.tick + 1
    finally:
        assert not client.pause(False).wait().paused


def test_calibrate_restores_the_content(client):
    client.write(1).wait()
    calibrated = client.calibrate().wait()
    assert calibrated.level == 1
    assert [len(calibrated.delays[end]) for end in ('left', 'right')] == [8, 8]
    assert calibrated.delays['right'][1] == pytest.approx(
        client.read(end='right').wait().delay, abs=5.0
    )


def test_parameters(client):
    values = client.parameters('write.method', 'read.end').wait()
    assert values == {'write.method': 'kick', 'read.end': ''}
    with pytest.raises(RequestRefused, match=r'design\.nothing'):
        client.parameters('element', 'design.nothing').wait()


def test_an_integer_is_converted_for_a_parameter_of_type_double(client):
    client.set_parameters({'time.speed': 2, 'faults.seed': 3}).wait()
    assert client.parameters('time.speed', 'faults.seed').wait() == {
        'time.speed': 2.0, 'faults.seed': 3,
    }  # fmt: skip
    with pytest.raises(RequestRefused, match=f"'{Parameter.Type.BOOL}'"):
        client.set_parameters({'time.speed': True}).wait()
    client.set_parameters({'time.speed': 1, 'faults.seed': 0}).wait()


def test_numbers_of_numpy_are_parameters(client):
    client.set_parameters({'faults.seed': np.int64(5), 'time.speed': np.float32(2.0)}).wait()
    assert client.parameters('faults.seed', 'time.speed').wait() == {
        'faults.seed': 5, 'time.speed': 2.0,
    }  # fmt: skip
    client.set_parameters({'time.speed': 1.0, 'faults.seed': np.uint8(0)}).wait()


def test_parameters_that_are_set_together_are_set_whole_or_not_at_all(client):
    """A speed at which no tick would ever end is none."""
    given = {'faults.seed': 4, 'time.speed': 1e-320}
    with pytest.raises(RequestRefused, match=r'time\.speed must be 0 .* got 1e-320'):
        client.set_parameters(given).wait()
    assert client.parameters('faults.seed').wait() == {'faults.seed': 0}
    with pytest.raises(RequestRefused, match=r'time\.speed'):
        client.set_parameters({'time.speed': 'fast'}).wait()


def test_waiting_spins_a_node_without_an_executor(node):
    """As in a node's __init__ that reads the content first."""
    client = MemoryClient(node, '/mlmem')
    assert client.write(2).wait().level == 2
    assert node.executor is None  # left as it was: rclpy.spin(node) may follow


def test_a_thread_waits_while_another_spins(node):
    client = MemoryClient(node, '/mlmem')
    with spinning(node):
        assert client.write(4).wait().level == 4
        assert client.read().wait().level == 4


def test_waiting_ends_with_its_node(node):
    reply = MemoryClient(node, '/nobody').read()
    node.destroy_node()
    with pytest.raises(NoAnswer, match='destroyed during read'):
        reply.wait()


# Awaiting


@pytest.mark.parametrize(
    'kind', [SingleThreadedExecutor, MultiThreadedExecutor, create_events_executor]
)
def test_a_callback_awaits(node, context, kind):
    client = MemoryClient(node, '/mlmem')

    async def write_and_read():
        await client.write(5)
        return await client.read()

    assert in_a_callback(node, kind(context=context), write_and_read).level == 5


def test_a_callback_that_blocks_gets_its_answer(node, context):
    """The answer does not need the executor that the callback blocks."""
    client = MemoryClient(node, '/mlmem')

    async def careless():
        return client.read().wait()

    content = in_a_callback(node, SingleThreadedExecutor(context=context), careless)
    assert content.attempts == 1


def test_all_threads_of_an_executor_wait(node, context):
    client = MemoryClient(node, '/mlmem')
    executor = MultiThreadedExecutor(2, context=context)
    both, told, over = threading.Barrier(2), [], Future()

    def wait(place):
        timers[place].cancel()  # or a third callback would wait at the barrier, in vain
        both.wait(SOON)  # until no thread is left that could spin the node
        told.append(client.parameters('write.method', timeout=SOON).wait())
        if both.wait(SOON) == 0:
            over.set_result(None)

    timers = [
        node.create_timer(0.001, partial(wait, place), MutuallyExclusiveCallbackGroup())
        for place in range(2)
    ]
    executor.add_node(node)
    executor.spin_until_future_complete(over, SOON)
    executor.shutdown(SOON)
    assert told == 2 * [{'write.method': 'kick'}]


def test_waiting_spins_a_node_whose_executor_does_not_spin(node, context):
    """rclpy.spin_once leaves a node with an executor that nobody spins."""
    client = MemoryClient(node, '/mlmem')
    executor = SingleThreadedExecutor(context=context)
    rclpy.spin_once(node, executor=executor, timeout_sec=0.0)
    assert node.executor is executor
    assert client.read(timeout=SOON).wait().attempts == 1


def test_timers_go_on_while_a_callback_of_the_group_awaits(node, context):
    """As in the README: without the client's group the robot would stop during a write."""
    client = MemoryClient(node, '/mlmem')
    executor, written, steps = SingleThreadedExecutor(context=context), Future(), []

    async def set_gait():
        begin.cancel()
        before = len(steps)
        await client.erase()
        written.set_result(len(steps) - before)

    node.create_timer(0.002, lambda: steps.append(None))
    begin = node.create_timer(0.01, set_gait, client.group)
    executor.add_node(node)
    executor.spin_until_future_complete(written, SOON)
    assert written.result() > 10


def test_waiting_ends_with_ros(node, context):
    reply = MemoryClient(node, '/nobody').read()
    rclpy.shutdown(context=context)
    with pytest.raises(NoAnswer, match='ROS was shut down during read'):
        reply.wait()


def test_nobody_complains_of_a_coroutine_that_awaits_when_ros_ends(node, context, caplog):
    client, executor, asked = (
        MemoryClient(node, '/nobody'),
        create_events_executor(context),
        Future(),
    )

    async def callback():
        timer.cancel()
        reply = client.read()
        asked.set_result(reply)
        await reply

    timer = node.create_timer(0.001, callback)
    executor.add_node(node)
    executor.spin_until_future_complete(asked, SOON)
    rclpy.shutdown(context=context)
    assert isinstance(asked.result().exception(SOON), NoAnswer)
    asked.result().freed.result(SOON)  # after all callbacks
    assert caplog.text == ''


def test_what_is_asked_after_the_end_is_answered_at_once(node, context):
    clients = [MemoryClient(node, '/nobody')]
    rclpy.shutdown(context=context)
    with standalone('nobody') as left:
        clients.append(left)
    for client in clients:
        for ask in (client.ready, client.read, client.pause):
            with pytest.raises(NoAnswer, match='ROS was shut down during'):
                ask().result(SOON)


def test_an_awaited_refusal_gives_the_reason(node, context):
    client = MemoryClient(node, '/mlmem')

    async def too_much():
        return await client.write(8)

    with pytest.raises(RequestRefused, match='8'):
        in_a_callback(node, SingleThreadedExecutor(context=context), too_much)


def test_replies_leave_nothing_behind(node, context):
    client = MemoryClient(node, '/mlmem')
    executor = SingleThreadedExecutor(context=context)

    async def some():
        await client.read()
        client.read().cancel()
        with contextlib.suppress(RequestError):
            await client.read()

    in_a_callback(node, executor, some)
    assert len(list(node.timers)) == 1  # that of in_a_callback
    client.abort().wait()  # the read that was cancelled


# In asyncio


def test_asyncio_awaits_without_anybody_spinning_the_node(node):
    client = MemoryClient(node, '/mlmem')

    async def write_and_read():
        beats = asyncio.create_task(beat())
        await client.write(4, timeout=SOON)
        content, (size,) = await asyncio.gather(client.read(), size_of(client))
        beats.cancel()
        return content.level, size

    async def size_of(client):
        return (await client.parameters('write.method')).values()

    async def beat():
        while True:
            beaten.append(None)
            await asyncio.sleep(0.001)

    beaten = []
    assert asyncio.run(asyncio.wait_for(write_and_read(), SOON)) == (4, 'kick')
    assert len(beaten) > 10  # others run meanwhile


def test_asyncio_awaits_a_client_with_a_thread_of_its_own(client):
    async def read():
        return await client.read()

    assert asyncio.run(read()).attempts == 1


def test_a_time_out_of_asyncio_gives_up_the_answer(node):
    """It stops nothing in the element, and leaves nothing on the node."""
    client = MemoryClient(node, '/mlmem')

    async def hurry():
        client.ready().wait()
        with pytest.raises(asyncio.TimeoutError):
            await asyncio.wait_for(asyncio.ensure_future(client.calibrate()), 0.05)

    asyncio.run(hurry())
    assert list(node.timers) == []
    client.abort().wait()


@pytest.mark.parametrize('kind', [SingleThreadedExecutor, MultiThreadedExecutor])
def test_a_callback_awaits_in_an_executor_that_asyncio_spins(node, context, kind):
    client, executor, read = MemoryClient(node, '/mlmem'), kind(context=context), Future()

    async def callback():
        timer.cancel()
        read.set_result(await client.read())

    async def spin():
        while not read.done():
            executor.spin_once(timeout_sec=0.0)
            await asyncio.sleep(0.001)

    timer = node.create_timer(0.001, callback)
    executor.add_node(node)
    asyncio.run(asyncio.wait_for(spin(), SOON))
    assert read.result().attempts == 1


def test_cancelled_tasks_leave_nothing_behind(node, client):
    """Neither an exception in the loop nor a callback, whenever the cancellation comes."""
    complaints = []

    async def cancel_many(memory):
        asyncio.get_running_loop().set_exception_handler(lambda _, said: complaints.append(said))
        replies, tasks = [], []
        for n in range(40):
            replies.append(memory.parameters('element'))
            tasks.append(asyncio.ensure_future(awaited(replies[-1])))
            await asyncio.sleep(n * 1e-4)  # an answer takes a millisecond or two
            tasks[-1].cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        await asyncio.sleep(0.05)
        assert all(reply.done() or reply.cancelled() for reply in replies)
        return sum(task.cancelled() for task in tasks)

    async def awaited(reply):
        return await reply

    cancelled = 0
    for memory in (client, MemoryClient(node, '/mlmem')):
        memory.ready().wait()
        cancelled += asyncio.run(cancel_many(memory))
    assert cancelled > 0
    assert complaints == []


def test_two_tasks_await_one_reply_and_one_gives_up(client, memory):
    client.pause().wait()

    async def awaited(reply):
        return await reply

    async def both():
        read = client.read()
        tasks = [asyncio.ensure_future(awaited(read)) for _ in range(2)]
        await asyncio.sleep(0.05)
        tasks[0].cancel()
        client.pause(False)
        return await asyncio.gather(*tasks, return_exceptions=True)

    given_up, content = asyncio.run(both())
    assert isinstance(given_up, asyncio.CancelledError)
    assert content.attempts == 1


def test_an_awaited_reply_that_was_cancelled_says_so(node):
    reply = MemoryClient(node, '/nobody').read()
    reply.cancel()

    async def late():
        return await reply

    with pytest.raises(NoAnswer, match='the answer to read was given up before it was sent'):
        asyncio.run(late())


# Refusals and failures


@pytest.fixture
def unchecked(monkeypatch):
    """Let messages take any value, as on a robot, where ROS_PYTHON_CHECK_FIELDS is not set."""
    for module in list(sys.modules.values()):
        if 'ros_python_check_fields' in vars(module):
            monkeypatch.setattr(module, 'ros_python_check_fields', '')


@pytest.mark.usefixtures('unchecked')
@pytest.mark.parametrize('actions', [True, False])
def test_an_invalid_level_is_not_sent(client, actions, monkeypatch):
    """Nor does the reply that is not made complain."""
    complaints = []
    monkeypatch.setattr(sys, 'unraisablehook', complaints.append)
    client = MemoryClient(client.node, '/mlmem', actions=actions)
    for level in (-1, 2.5, True, '3', None):
        with pytest.raises(ValueError, match='level must be a whole number of at least 0; got'):
            client.write(level)
    gc.collect()
    for level in (2**63 + 5, 2**70 + 5):  # 5 in so many bits
        with pytest.raises(ValueError, match='level must be a whole number from'):
            client.write(level)
    for level in (8, 65541, 2**31 + 5):
        with pytest.raises(RequestRefused, match='level must be a whole number from 0 to 7; got'):
            client.write(level).wait()
    assert [each for each in complaints if each.object is Future.__del__] == []


@pytest.mark.usefixtures('unchecked')
def test_other_arguments_that_no_message_holds_are_not_sent(client):
    for wrong in (2.5, '3'):
        with pytest.raises(ValueError, match='level must be a whole number'):
            client.request('write', level=wrong)
    with pytest.raises(ValueError, match=r"request must be one of write, .*; got 'explode'"):
        client.request('explode')
    with pytest.raises(ValueError, match="write takes level, word; got 'levl'"):
        client.request('write', levl=3)
    for wrong in ('3', None, True, float('nan'), -1):
        with pytest.raises(ValueError, match='timeout must be above 0 s; got'):
            client.read(timeout=wrong)
    with pytest.raises(ValueError, match=r'faults\.seed must be true or false, a number, a text'):
        client.set_parameters({'faults.seed': {}})
    with pytest.raises(ValueError, match='end must be a text; got 3'):
        client.read(end=3)
    with pytest.raises(ValueError, match='path must be a text; got 3'):
        client.record(path=3)
    with pytest.raises(ValueError, match=r'faults\.seed must be a whole number'):
        client.set_parameters({'faults.seed': 2**63})


@pytest.mark.usefixtures('unchecked')
def test_what_cannot_be_sent_stops_no_executor(node):
    """The error is the caller's: the robot spins on."""
    with spinning(node):
        asked = MemoryClient(node, '/mlmem').parameters(3)
        wait_until(asked.done, 'the end of the reply', SOON)
        assert isinstance(asked.exception(), TypeError)
        turned = Future()
        node.create_timer(0.001, lambda: turned.set_result(None))
        wait_until(turned.done, 'a timer of the robot', SOON)


@pytest.fixture
def under_way(client, memory):
    """Begin to write a level: under_way(level) returns the reply while time is paused."""

    def under_way(level):
        client.erase().wait()
        client.pause().wait()
        writing = client.write(level)
        arrived(memory)
        memory.step(50)  # until it is strained
        return writing

    yield under_way
    client.pause(False).wait()


def test_a_busy_element_refuses(client, memory, under_way):
    writing = under_way(6)
    refused(memory, client.read(), 'busy')
    client.pause(False).wait()
    assert writing.wait().level == 6


def test_reads_of_one_client_wait_for_one_another(client, node):
    """With an executor or without; as many as anybody needs, but not for ever more."""
    for each in (
        client,
        MemoryClient(node, '/mlmem'),
        MemoryClient(node, '/mlmem', actions=False),
    ):
        reads = [each.read(timeout=SOON) for _ in range(3)]
        assert [read.wait().attempts for read in reversed(reads)] == [1, 1, 1]
    reads = [client.read(timeout=SOON) for _ in range(21)]
    with pytest.raises(RequestRefused, match='busy: 20 requests are already waiting'):
        reads.pop().wait()
    assert [read.wait().attempts for read in reads] == 20 * [1]


@pytest.mark.parametrize('actions', [True, False])
@pytest.mark.parametrize('late', [True, False])
def test_a_read_waits_for_one_that_was_given_up(client, memory, late, actions):
    """The element goes on with it; the next one used to be refused as busy."""
    memory = MemoryClient(client.node, memory.element, actions=actions)
    memory.read().wait()
    for given_up in (0, 1):
        memory.pause().wait()
        reads = [memory.read(timeout=0.3 if late and n == given_up else SOON) for n in range(3)]
        second = reads.pop(given_up)
        if late:
            with pytest.raises(NoAnswer, match='did not answer read within'):
                second.wait()
        else:
            second.cancel()
        memory.pause(False).wait()
        assert [read.wait().attempts for read in reads] == [1, 1]


def test_an_aborted_write_fails(client, memory, under_way):
    writing, aborting = under_way(7), client.abort()
    wait_until(lambda: memory.step(10) and aborting.done(), 'the abort', SOON)
    with pytest.raises(RequestFailed, match='aborted') as failure:
        writing.wait()
    assert not isinstance(failure.value, RequestRefused)
    assert failure.value.answer['procedure'] == 'write'


@pytest.mark.parametrize('message', ['', 'ok', '[]', '7', '{"procedure": "read", "level": 1}'])
def test_an_answer_that_cannot_be_understood(context, stand_in, message):
    stand_in.answer = message
    reading = MemoryClient(stand_in.node, '/stand_in').read()
    refused = pytest.raises(
        RequestFailed, match=r'must be JSON|must be an object|lacks attempts, ticks'
    )
    with spinning(stand_in.node), refused:
        reading.wait()


def test_no_node_of_that_name(client, monkeypatch):
    """While it waits for one, it looks now and then, and leaves the core to others."""
    ready, looked = Link.ready, []
    monkeypatch.setattr(Link, 'ready', lambda *asked: looked.append(asked) or ready(*asked))
    nobody = MemoryClient(client.node, '/nobody', patience=0.2)
    with pytest.raises(NoAnswer, match=r'/nobody within 0\.2 s; start one'):
        nobody.read().wait()
    assert (
        len(looked) <= 4 * 0.2 / line.SERVICE_CHECK_PERIOD_S
    )  # for an action and for a service; not thousands
    with pytest.raises(NoAnswer, match='/nobody'):
        nobody.ready(0.1).wait()


def test_an_answer_that_does_not_come_in_time(client):
    client.pause().wait()
    try:
        with pytest.raises(NoAnswer, match=r'did not answer read within 0\.2 s'):
            client.read(timeout=0.2).wait()
    finally:
        client.pause(False).wait()
    with pytest.raises(ValueError, match='timeout must be above 0 s; got 0'):
        client.read(timeout=0)


def test_names_are_relative_to_the_namespace_of_the_node(context):
    node = rclpy.create_node('arm', namespace='/robot', context=context)
    assert MemoryClient(node).name == '/robot/mlmem'
    assert MemoryClient(node, 'left/mlmem').name == '/robot/left/mlmem'
    assert MemoryClient(node, '/mlmem').name == '/mlmem'
    node.destroy_node()


def test_a_client_leaves_with_its_robots_node(robot, context):
    """It stayed if that node was collected before the client's thread had looked for it."""

    def come_and_go():
        node = rclpy.create_node('passer_by', context=context, use_global_arguments=False)
        assert MemoryClient(node, '/mlmem').read(timeout=SOON).wait().attempts == 1
        time.sleep(0.2)  # the client's thread looks every 50 ms while something pends
        node.destroy_node()

    come_and_go()
    gc.collect()
    wait_until(lambda: '_passer_by_mlmem' not in robot.node.get_node_names(), 'its end', SOON)


def test_the_package_is_imported_without_ros():
    code = (
        'import sys; sys.modules["rclpy"] = None; import mlmem_ros\n'
        'assert "MemoryClient" in dir(mlmem_ros)\n'
        'try: mlmem_ros.MemoryClient\n'
        'except ModuleNotFoundError as error: assert error.name.startswith("rclpy"), error\n'
        'else: raise SystemExit("rclpy was there")\n'
    )
    subprocess.run([sys.executable, '-c', code], check=True, timeout=60)


# Several clients


def test_two_writes_at_once_are_done_one_after_the_other(memory, client, robot):
    """Each with its own level, unlike requests that first set a parameter and then trigger."""
    client.erase().wait()
    kept = robot.get('target_level')
    with standalone(memory.element) as other:
        other.ready().wait()
        replies = {1: client.write(1), 2: other.write(2)}
        contents = {level: reply.wait() for level, reply in replies.items()}
    assert {level: content.level for level, content in contents.items()} == {1: 1, 2: 2}
    assert client.read().wait().level in (1, 2)
    assert robot.get('target_level') == kept


def test_an_answer_names_the_requested_level(robot):
    robot.set(target_level=3)
    assert robot.trigger('write')['asked'] == 3
    refused = robot.answer(robot.ask('write', level=9))
    assert (refused.success, refused['asked']) == (False, 9)


def test_the_end_to_probe_is_given_for_one_read(client):
    client.write(2).wait()
    assert client.read(end='right').wait().end == 'right'
    assert client.read(end='both').wait().details['walls'] == 1
    assert client.read().wait().end == 'left'
    with pytest.raises(RequestRefused, match="end must be one of left, right, both; got 'top'"):
        client.read(end='top').wait()
    assert client.parameters('read.end').wait() == {'read.end': ''}


# Strain by hand, and sessions


def test_a_strain_profile_is_sent_and_followed(memory, client, robot):
    """First at 5/s, the limit at 10 us per time unit; then smoothly back."""
    client.follow([0.004, 0.05], [0.02, 0.02]).wait()
    robot.next('joint_states', lambda state: state.position[0] == pytest.approx(0.02 * 225 * 0.01))
    client.follow([0.02], [0.0], [0.0]).wait()
    robot.next('joint_states', lambda state: state.position[0] == 0.0)


@pytest.mark.parametrize(
    ('times', 'strains', 'rates', 'message'),
    [
        ([0.1, 0.2], [0.0], [], 'strains must be 2, one for every point'),
        ([0.1, 0.2], [0.0, 0.0], [0.0], 'rates must be 2, one for every point, or none'),
        ([float('nan')], [0.0], [], 'times must be finite numbers; got nan'),
        ([-1.0], [0.0], [], 'times must be rising from 0 s'),
        ([], [], [], 'times must be 1 to 10000 points; got 0'),
        ([1.0], [0.5], [], r'the strain must stay within 0.15 \(actuator.max_strain\)'),
    ],
)
def test_a_profile_that_cannot_be_followed_is_refused(client, times, strains, rates, message):
    with pytest.raises(RequestRefused, match=message):
        client.follow(times, strains, rates).wait()


def test_a_profile_is_refused_during_a_write(client, memory, under_way):
    writing = under_way(5)
    refused(memory, client.follow([1.0], [0.0]), 'busy: write is running')
    client.pause(False).wait()
    assert writing.wait().level == 5


def test_a_session_is_recorded_and_ended(client, tmp_path):
    bag = str(tmp_path / 'session')
    with pytest.raises(RequestRefused, match="'/' must be the path of a file"):
        client.record(path='/').wait()
    begun = client.record(path=bag).wait()
    assert (begun.recording, begun.path) == (True, bag)
    with pytest.raises(RequestRefused, match='busy: recording into'):
        client.record().wait()
    ended = client.record(False).wait()
    assert (ended.recording, ended.path) == (False, bag)
    with pytest.raises(RequestRefused, match='nothing is being recorded'):
        client.record(False).wait()
    assert client.parameters('record.path').wait() == {'record.path': ''}  # given once
