# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Requests wait for their turn, over real DDS."""

import asyncio

import pytest
from nodes import step_until_arrived
from timeouts import TIMEOUT_S

from mlmem_ros import RequestFailed, RequestRefused
from mlmem_ros.contract.requests import load_action_types

GIVEN = {'actions': True, 'queue.most': 3}


@pytest.fixture(autouse=True)
def time_goes_on(memory):
    yield
    memory.memory.pause(False).wait()


def begin_writes(memory, *levels):
    """Pause time and write levels, the first of which begins; return the replies."""
    memory.memory.pause().wait()
    replies = []
    for waiting, level in enumerate(levels):
        replies.append(memory.memory.request('write', TIMEOUT_S, level=level))
        step_until_arrived(memory, waiting)
    return replies


def test_request_past_its_deadline_is_rejected(memory, client):
    """Although time stands."""
    replies = begin_writes(memory, 1, 2, 3)
    late = client.request('read', TIMEOUT_S, deadline=0.5)
    step_until_arrived(memory, 3, unless=late.done)
    with pytest.raises(RequestRefused, match='while it waited for its turn') as caught:
        late.wait()
    assert caught.value.answer['error_code'] == 'busy'
    memory.memory.pause(False).wait()
    assert [reply.wait().details['level'] for reply in replies] == [1, 2, 3]


@pytest.mark.skipif(not load_action_types(), reason='mlmem_interfaces is not built')
def test_feedback_of_a_waiting_goal_says_its_place(memory):
    """It moves up when one before it begins, or is canceled."""
    client, feedback = memory.memory, []

    async def watch(goal):
        async for each in goal:
            feedback.append(each)

    async def step_until(place):
        while not feedback or feedback[-1].place != place:
            await asyncio.sleep(0.02)
            await client.step()

    async def watch_last():
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
        await client.pause(False)
        await asyncio.gather(first, watching)
        await client.set_parameters({'time.speed': 1.0})
        return (await goals[1]).level

    assert asyncio.run(asyncio.wait_for(watch_last(), TIMEOUT_S)) == 3
    places = [each.place for each in feedback]
    assert places == sorted(places, reverse=True)
    assert set(places) == {2, 1, 0}
    assert {each.phase == 'waiting' for each in feedback if each.place} == {True}
    assert feedback[-1].phase != 'waiting'
