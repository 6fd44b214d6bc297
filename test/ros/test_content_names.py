# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A write that names a level to a register, or a word to one wall, is rejected over real DDS."""

import contextlib

import pytest
from robot import ActionTool, values

from mlmem_ros import RequestRefused
from mlmem_ros.contract.requests import load_action_types

HELD = {'case_2': 'level', 'byte': 'word'}
BEFORE, OTHER = 3, 2


@pytest.fixture(scope='module', params=HELD)
def element(request):
    return request.param


@pytest.fixture(scope='module')
def memory(element, start_shared):
    return start_shared({'element': element, 'actions': True}, name=element)


@pytest.fixture
def held(element, client):
    """The name of what the element holds, which is `BEFORE`."""
    client.write(BEFORE).wait()
    return HELD[element]


@pytest.fixture
def wrong(held):
    return 'word' if held == 'level' else 'level'


def count_refused(robot):
    """Return the refused requests from a report made after this call."""
    robot.next('/diagnostics')  # made before the call, perhaps
    return int(values(robot.next_status('loop'))['refused'])


def test_request_with_the_wrong_name_is_rejected(robot, client, held, wrong):
    counted = count_refused(robot)
    for given in ({wrong: OTHER}, {held: OTHER, wrong: OTHER}):
        with pytest.raises(RequestRefused, match=f'{wrong} must be .* holds a {held}') as refused:
            client.request('write', **given).wait()
        answer = refused.value.answer
        assert (answer['error_code'], answer['field']) == ('unsupported', wrong)
    assert count_refused(robot) == counted + 2
    assert client.read().wait().details[held] == BEFORE


def test_level_of_the_topic_is_rejected_by_a_register(robot, client, held, memory):
    seen, counted = len(memory.output), count_refused(robot)
    robot.publish('write_level', OTHER)
    if held == 'word':
        robot.wait(lambda: '/write_level refused' in memory.output[seen:], 'the rejection')
        assert 'level must be' in memory.output[seen:]
        assert count_refused(robot) == counted + 1
    else:
        robot.latest('level', lambda message: message.data == OTHER)
    assert client.read().wait().details[held] == (BEFORE if held == 'word' else OTHER)


@pytest.mark.skipif(not load_action_types(), reason='mlmem_interfaces is not built')
def test_goal_with_the_wrong_name_is_rejected(robot, client, held, wrong):
    counted = count_refused(robot)
    with contextlib.closing(ActionTool(robot, 'write', load_action_types()['write'])) as write:
        for given in ({wrong: OTHER}, {held: OTHER, wrong: OTHER}):
            result = write.do(**given).result
            assert result.error_code == result.REFUSED
            assert result.error.startswith(f'{wrong} must be')
            assert f'holds a {held}' in result.error
        assert count_refused(robot) == counted + 2
        assert client.read().wait().details[held] == BEFORE
        for given in ({held: OTHER}, {'content': BEFORE}):
            result = write.do(**given).result
            assert (result.error, getattr(result, held)) == ('', *given.values())


@pytest.mark.parametrize('uses_actions', [True, False])
def test_client_writes_one_integer_whatever_the_element_holds(client, held, uses_actions):
    plain = type(client)(client.node, client.name, actions=uses_actions)
    for written in (plain.write(OTHER), plain.procedure('write', **{held: OTHER})):
        answer = written.wait()
        assert (answer.content, answer.details[held], answer.details['asked']) == (OTHER,) * 3
