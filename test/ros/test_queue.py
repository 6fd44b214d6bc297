# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Requests of different clients wait for their turn, over real DDS."""

import asyncio
from contextlib import ExitStack

import pytest
from nodes import arrived, refused
from timeouts import TIMEOUT_S

from mlmem_ros import RequestFailed, RequestRefused, standalone
from mlmem_ros.contract.requests import load_action_types

MOST = 3
"""Requests that may wait."""

GIVEN = {'actions': True, 'queue.most': MOST}


@pytest.fixture(scope='module')
def others(memory):
    """More clients than may wait, each with a node of its own."""
    with ExitStack() as stack:
        clients = [stack.enter_context(standalone(memory.element)) for _ in range(MOST + 2)]
        for each in clients:
            each.ready(60).wait()
        yield clients


@pytest.fixture(autouse=True)
def time_goes_on(memory):
    yield
    memory.memory.pause(False).wait()


def under_way(memory, others, *levels):
    """Pause time and have clients write levels, the first of which begins; return the replies."""
    memory.memory.pause().wait()
    replies = []
    for waiting, (client, level) in enumerate(zip(others, levels, strict=False)):
        replies.append(client.request('write', TIMEOUT_S, level=level))
        arrived(memory, waiting)
    return replies


def test_requests_of_one_client_wait_for_one_another(client):
    """Two at a time is what asyncio's `gather` sends."""
    replies = [client.write(level, timeout=TIMEOUT_S) for level in (2, 3, 1)]
    assert [reply.wait().level for reply in replies] == [2, 3, 1]


def test_full_queue_rejects_the_next_request(memory, others):
    replies = under_way(memory, others, *range(MOST + 1))
    refused(memory, others[-1].request('read', TIMEOUT_S), 'busy')
    refused(memory, others[-1].request('write', TIMEOUT_S, level=8), 'out_of_range')
    memory.memory.pause(False).wait()
    assert [reply.wait().details['level'] for reply in replies] == [*range(MOST + 1)]


def test_request_past_its_deadline_is_rejected(memory, others):
    """Although time stands."""
    replies = under_way(memory, others, 1, 2, 3)
    late = others[4].request('read', 60.0, deadline=0.5)
    arrived(memory, 3)
    with pytest.raises(RequestRefused, match='while it waited for its turn'):
        late.wait()
    memory.memory.pause(False).wait()
    assert [reply.wait().details['level'] for reply in replies] == [1, 2, 3]


def test_abort_faults_and_queries_do_not_wait(memory, client, others):
    first, second = under_way(memory, others, 5, 6)
    refused(memory, client.follow([1.0], [0.0]), 'busy')
    client.set_parameters({'faults.seed': 3}).wait()
    assert client.parameters('faults.seed').wait() == {'faults.seed': 3}
    aborting = client.abort()
    memory.memory.pause(False).wait()
    assert aborting.wait().attempts == 1
    with pytest.raises(RequestFailed, match='aborted'):
        first.wait()
    assert second.wait().details['level'] == 6


@pytest.mark.skipif(not load_action_types(), reason='mlmem_interfaces is not built')
def test_feedback_of_a_waiting_goal_says_its_place(memory, others):
    """It moves up when one before it begins, or is canceled."""

    async def watch(goal):
        return [feedback async for feedback in goal], (await goal).level

    async def step_on():
        for _ in range(20):
            await asyncio.sleep(0.02)
            await memory.memory.step()

    async def watch_last():
        (first,) = under_way(memory, others, 1)
        goals = []
        for place in (1, 2):
            goals.append(others[place].write(place + 1))
            arrived(memory, place)
        watching = asyncio.create_task(watch(goals[1]))
        await step_on()
        assert goals[0].cancel_goal()
        await step_on()
        with pytest.raises(RequestFailed, match='canceled by its client while it waited'):
            await goals[0]
        await memory.memory.set_parameters({'time.speed': 0.2})  # a write outlasts many reports
        await memory.memory.pause(False)
        await first
        ended = await watching
        await memory.memory.set_parameters({'time.speed': 1.0})
        return ended

    feedback, level = asyncio.run(watch_last())
    assert level == 3
    places = [each.place for each in feedback]
    assert places == sorted(places, reverse=True)
    assert set(places) == {2, 1, 0}
    assert {each.phase == 'waiting' for each in feedback if each.place} == {True}
    assert (feedback[-1].place, feedback[-1].phase == 'waiting') == (0, False)


def test_node_without_a_queue_rejects_at_once(start):
    node = start({'queue.most': 0}, name='alone')
    with standalone(node.element) as other:
        other.ready(TIMEOUT_S).wait()
        (write,) = under_way(node, [other], 1)
        refused(node, node.memory.request('read', TIMEOUT_S), 'busy')
        other.pause(False).wait()
        write.wait()
