# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A page's messages become requests of the client, or are refused before they are sent."""

import asyncio
import math
from types import SimpleNamespace
from unittest.mock import AsyncMock, Mock, call

import pytest

from mlmem.settings import ActuatorSettings, ScaleSettings, Settings
from mlmem_ros.contract.answers import SelfTested
from mlmem_tools.view.requests import Activity, PageRequests

ACTUATOR, SCALE = ActuatorSettings(max_strain=0.08, hand_rate=1e-4), ScaleSettings(time=1e-4)


@pytest.fixture
def client():
    return Mock()


@pytest.fixture
def requests(client):
    requests = PageRequests(client, Activity())
    requests.about = SimpleNamespace(settings=Settings(actuator=ACTUATOR, scale=SCALE))
    return requests


@pytest.mark.parametrize(
    ('asked', 'sent'),
    [
        ({'do': 'write', 'level': 5}, call.procedure('write', 600.0, level=5)),
        ({'do': 'write', 'word': 8}, call.procedure('write', 600.0, word=8)),
        ({'do': 'read', 'end': 'both'}, call.procedure('read', 600.0, end='both')),
        ({'do': 'kick', 'speed': 0.05}, call.procedure('kick', 600.0, speed=0.05)),
        ({'do': 'locate'}, call.procedure('locate', 600.0)),
        ({'do': 'pause', 'hold': False}, call.pause(False)),
        ({'do': 'speed', 'speed': 2}, call.set_parameters({'time.speed': 2.0})),
        (
            {'do': 'fault', 'name': 'stuck_cell', 'value': 7},
            call.set_parameters({'faults.stuck_cell': 7}),
        ),
        (
            {'do': 'fault', 'name': 'damping_factor', 'value': 2},
            call.set_parameters({'faults.damping_factor': 2.0}),
        ),
    ],
)
def test_message_of_a_page_becomes_a_request(requests, client, asked, sent):
    requests.send_request(asked)
    assert client.method_calls == [sent]


@pytest.mark.parametrize(
    'asked',
    [
        {},
        {'do': 'shutdown'},
        {'do': ['write']},
        {'do': 'strain', 'strain': math.nan},
        {'do': 'strain', 'strain': 2.0},
        {'do': 'speed', 'speed': math.inf},
        {'do': 'speed', 'speed': 1e-320},
        {'do': 'fault', 'name': 'design.N', 'value': 1},
        {'do': 'fault', 'name': ['seed'], 'value': 1},
        {'do': 'fault', 'name': 'sensor_noise', 'value': 'x'},
        {'do': 'fault', 'name': 'sensor_noise', 'value': -(10**400)},
    ],
)
def test_invalid_request_of_a_page_is_not_sent(requests, client, asked):
    with pytest.raises(ValueError, match=r'must be|no request|be given'):
        requests.send_request(asked)
    assert not client.method_calls


def test_request_that_fails_is_answered(requests, client, caplog):
    client.procedure = lambda *_: 1 / 0
    answer = asyncio.run(requests.serve_request({'do': 'erase'}))
    assert (answer['ok'], answer['kind']) == (False, 'failed')
    assert 'ZeroDivisionError' in answer['text']
    assert 'Traceback' in caplog.text


def test_drag_becomes_a_smooth_move_within_the_limits(requests, client):
    """Through its whole range within the rate; the peak of a cubic is 1.5 times its mean."""
    requests.send_request({'do': 'strain', 'strain': -0.03})
    times, strains, rates = client.follow.call_args.args
    assert strains == [-0.03]
    assert rates == [0.0]
    fastest = 1.5 * 2.0 * ACTUATOR.max_strain / times[0]
    assert fastest < ACTUATOR.hand_rate_limit / SCALE.time


@pytest.mark.parametrize('failed', [(), ('levels',)])
def test_self_test_answer_lists_every_check(requests, client, failed):
    """Also if some of them fail: then the answer says which."""
    answered = SelfTested({}, not failed, {'erase': 'blank', 'levels': '7 is 6'}, failed)
    client.procedure = AsyncMock(return_value=answered)
    told = asyncio.run(requests.serve_request({'do': 'self_test'}))
    checks = [['erase', True, 'blank'], ['levels', not failed, '7 is 6']]
    assert (told['ok'], told['details']['checks']) == (not failed, checks)
    assert not failed or 'levels' in told['text']


def test_clear_faults_sets_every_healthy_value(requests, client):
    requests.send_request({'do': 'clear_faults'})
    (values,) = client.set_parameters.call_args.args
    assert values['faults.actuator_stuck'] is False
    assert values['faults.damping_factor'] == 1.0
    assert 'faults.seed' not in values


def test_activity_follows_requests_and_diagnostics():
    activity = Activity()
    assert activity.describe_running() == {}
    assert activity.note_request({'do': 'write', 'level': 3})
    assert activity.describe_running()['doing']['name'] == 'write'
    assert activity.describe_running()['doing']['content'] == 3
    assert not activity.note_request({'do': 'erase'})  # it will be refused: a write runs
    activity.note_end('write')
    assert activity.describe_running() == {}
    activity.take_report('')
    assert not activity.note_request({'do': 'strain'})
