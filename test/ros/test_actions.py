# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Actions over real DDS: by rclpy's own action client, and by `MemoryClient`."""

import asyncio
import math
import re
import time
from concurrent.futures import CancelledError

import pytest
from suite import TIMEOUT_S

from mlmem_ros.contract import requests

if not requests.load_action_types():
    pytest.skip('mlmem_interfaces is not built: make interfaces', allow_module_level=True)

from action_msgs.msg import GoalInfo, GoalStatus, GoalStatusArray
from action_msgs.srv import CancelGoal
from mlmem_interfaces.action import Read
from nodes import run_in_executor, step_until_arrived
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.qos import qos_profile_action_status_default
from robot import values

from mlmem_ros import MemoryClient, RequestFailed, RequestRefused
from mlmem_ros.ros.client.client import wait_until
from mlmem_ros.ros.middleware import create_events_executor

GIVEN = {'actions': True, 'queue.most': 3}


@pytest.fixture
def slowly(robot):
    """Level 0 is written, and the next write takes almost a second."""
    assert robot.write(0).success
    robot.set(time__speed=0.05)
    yield
    robot.set(time__speed=1.0)


def test_goal_writes_reads_and_erases(robot):
    write, erase = robot.action('write'), robot.action('erase')
    assert erase.do().result.level == -1
    ended = write.do(level=3)
    result = ended.result
    assert ended.status == GoalStatus.STATUS_SUCCEEDED
    assert (result.error_code, result.error) == (result.NONE, '')
    assert (result.level, result.code, result.end, result.attempts) == (3, '011', 'left', 1)
    assert result.confidence > 0.5
    assert robot.action('read').do(end='right').result.level == 3
    assert write.do(content=2).result.level == 2


@pytest.mark.parametrize(
    ('name', 'goal', 'field'),
    [
        ('write', {}, 'level'),
        ('write', {'level': 2, 'content': 3}, 'content'),
        ('write', {'word': 2}, 'word must be .* holds a level'),
        ('write', {'level': 2, 'word': 2}, 'word must be .* holds a level'),
        ('write', {'level': 99}, 'level'),
        ('write', {'level': 65541}, 'level'),  # 5, if it were cut to 16 bits
        ('write', {'level': -(2**63)}, 'level'),
        ('read', {'end': 'top'}, 'end must be'),
        ('read', {'deadline': math.nan}, 'deadline'),
        ('erase', {'deadline': -1.0}, 'deadline'),
    ],
    ids=str,
)
def test_goal_out_of_range_is_rejected_with_its_field(robot, name, goal, field):
    ended = robot.action(name).do(**goal)
    assert ended.status == GoalStatus.STATUS_ABORTED
    assert ended.result.error_code == ended.result.REFUSED
    assert re.search(field, ended.result.error)


@pytest.mark.usefixtures('slowly')
def test_cancel_of_a_write_ends_it_as_canceled(robot):
    write = robot.action('write')
    running = write.send(level=7)
    robot.wait(lambda: write.feedback, 'its feedback')
    (canceled,) = robot.response(running.cancel_goal_async()).goals_canceling
    assert bytes(canceled.goal_id.uuid) == bytes(running.goal_id.uuid)
    ended = write.result(running)
    assert ended.status == GoalStatus.STATUS_CANCELED
    assert ended.result.error_code == ended.result.CANCELED
    assert write.do(level=1).result.level == 1
    outcome = robot.latest('outcome', lambda status: values(status)['procedure'] == 'write')
    assert outcome.level == b'\0'


def test_cancel_of_an_ended_goal_stops_no_other(robot):
    write, read = robot.action('write'), robot.action('read')
    other = read.send()
    read.result(other)
    with robot.paused():
        running = write.send(level=6)
        late = robot.response(other.cancel_goal_async())
        assert late.return_code == CancelGoal.Response.ERROR_GOAL_TERMINATED
    assert write.result(running).status == GoalStatus.STATUS_SUCCEEDED


def test_status_lists_no_goal_whose_result_was_fetched(robot):
    seen, read = [], robot.action('read')
    subscription = robot.node.create_subscription(
        GoalStatusArray, robot.name('read/_action/status'), seen.append,
        qos_profile_action_status_default,
    )  # fmt: skip
    for _ in range(3):
        read.do()
    last = read.send()
    read.result(last)
    robot.wait(
        lambda: seen and seen[-1].status_list[-1].goal_info.goal_id == last.goal_id, 'its status'
    )
    assert len(seen[-1].status_list) == 1
    robot.node.destroy_subscription(subscription)


def test_unknown_goal_has_no_result(robot):
    name = 'read/_action'
    unknown = GoalInfo()
    unknown.goal_id.uuid[0] = 7
    answer = robot.call(f'{name}/cancel_goal', CancelGoal, goal_info=unknown)
    assert answer.return_code == CancelGoal.Response.ERROR_UNKNOWN_GOAL_ID
    result = robot.call(f'{name}/get_result', Read.Impl.GetResultService)
    assert result.status == GoalStatus.STATUS_UNKNOWN


@pytest.mark.usefixtures('slowly')
@pytest.mark.parametrize(
    'kind', [SingleThreadedExecutor, MultiThreadedExecutor, create_events_executor]
)
def test_client_iterates_progress_in_any_executor(memory, context, create_node, kind):
    node, executor = create_node('behaviour'), kind(context=context)
    client = MemoryClient(node, memory.element)
    client.ready(TIMEOUT_S).wait()

    async def watch():
        begun, write = time.monotonic(), client.write(7)
        told = [feedback async for feedback in write]
        return told, await write, time.monotonic() - begun

    told, content, seconds = run_in_executor(node, executor, watch)
    assert content.level == 7
    shares = [each.share for each in told]
    assert shares == sorted(shares)
    assert shares[-1] > 0.5
    assert {'settling', 'listening'} <= {each.phase for each in told}  # a launch is shorter
    assert len(told) < 2 + seconds / 0.05  # it comes no more often than it should
    # The timers that woke the executor are gone.
    wait_until(lambda: executor.spin_once(0.01) or not list(node.timers), 'their end', TIMEOUT_S)


@pytest.mark.usefixtures('slowly')
@pytest.mark.parametrize('ended', ['by cancel_goal', 'by cancel', 'by a time-out of asyncio'])
def test_cancelled_request_cancels_its_procedure(client, robot, ended):
    outcomes = robot.received('outcome')
    seen = len(outcomes)
    write = client.write(7)
    if ended == 'by cancel_goal':
        assert write.cancel_goal()
    elif ended == 'by cancel':
        client.parameters('element').wait()  # sent after the goal
        assert write.cancel()
    else:
        with pytest.raises(asyncio.TimeoutError):
            asyncio.run(asyncio.wait_for(write, 0.2))
    with pytest.raises(RequestFailed if ended == 'by cancel_goal' else CancelledError):
        write.wait()
    client.abort().wait()  # once the strain is zero
    robot.received('outcome')  # before another replaces it
    assert not write.cancel_goal()
    assert client.write(1).wait().level == 1
    robot.wait(lambda: outcomes[seen:] and values(outcomes[-1]).get('level') == '1', 'level 1')
    assert not any(values(each).get('level') == '7' for each in outcomes[seen:])


def begin_writes(memory, *levels):
    """Write levels, the first of which begins, while time is paused; return the replies."""
    replies = []
    for waiting, level in enumerate(levels):
        replies.append(memory.memory.request('write', TIMEOUT_S, level=level))
        step_until_arrived(memory, waiting)
    return replies


def test_request_past_its_deadline_is_rejected(memory, client, robot):
    """Although time stands."""
    with robot.paused():
        replies = begin_writes(memory, 1, 2, 3)
        late = client.request('read', TIMEOUT_S, deadline=0.5)
        step_until_arrived(memory, 3, unless=late.done)
        with pytest.raises(RequestRefused, match='while it waited for its turn') as caught:
            late.wait()
        assert caught.value.answer['error_code'] == 'busy'
    assert [reply.wait().details['level'] for reply in replies] == [1, 2, 3]


def test_feedback_of_a_waiting_goal_says_its_place(memory, client, robot):
    """It moves up when one before it begins, or is canceled."""
    feedback = []

    async def watch(goal):
        async for each in goal:
            feedback.append(each)

    async def step_until(place):
        while not feedback or feedback[-1].place != place:
            await asyncio.sleep(0.02)
            await client.step()

    async def watch_last():
        with robot.paused():
            (first,) = begin_writes(memory, 1)
            goals = []
            for place in (1, 2):
                goals.append(client.write(place + 1))
                step_until_arrived(memory, place)
            watching = asyncio.create_task(watch(goals[1]))
            await step_until(place=2)
            assert goals[0].cancel_goal()
            await step_until(place=1)
            with pytest.raises(RequestFailed, match='canceled by its client while it waited'):
                await goals[0]
            await client.set_parameters({'time.speed': 0.2})  # a write outlasts many reports
        await asyncio.gather(first, watching)
        await client.set_parameters({'time.speed': 1.0})
        return (await goals[1]).level

    assert asyncio.run(asyncio.wait_for(watch_last(), TIMEOUT_S)) == 3
    places = [each.place for each in feedback]
    assert places == sorted(places, reverse=True)
    assert set(places) == {2, 1, 0}
    assert {each.phase == 'waiting' for each in feedback if each.place} == {True}
    assert feedback[-1].phase != 'waiting'


def test_goal_under_way_is_rejected_at_the_shutdown(memory, client):
    """The last test of this node."""
    client.write(0).wait()
    client.set_parameters({'time.speed': 0.01}).wait()  # it does not end before the node
    client.pause().wait()
    write = client.write(7)
    client.pause(False).wait()
    memory.terminate()
    with pytest.raises(RequestFailed, match='shut down'):
        write.wait()
    assert memory.exit_status() == 0
