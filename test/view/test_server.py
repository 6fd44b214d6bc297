# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The page server: who may drive the element, slow pages, and what becomes of their requests."""

import asyncio
import io
import math
import zipfile
from functools import wraps
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import AsyncMock, Mock, call

import pytest

aiohttp = pytest.importorskip('aiohttp')

from aiohttp.test_utils import TestClient, TestServer  # noqa: E402
from page_frame import unpack_frame  # noqa: E402

from mlmem.settings import ActuatorSettings, ScaleSettings, Settings  # noqa: E402
from mlmem_ros.contract.answers import SelfTested  # noqa: E402
from mlmem_tools.view.frames import pack_frame  # noqa: E402
from mlmem_tools.view.live import Page  # noqa: E402
from mlmem_tools.view.requests import Activity, PageRequests  # noqa: E402
from mlmem_tools.view.server import Server  # noqa: E402


class ElementStandIn:
    """A stand-in for a running element that notes its requests."""

    def __init__(self):
        self.pages = set()
        self.requests = self
        self.recordings = []
        self.asked = []

    def open(self):
        page = Page()
        self.pages.add(page)
        return page

    def close(self, page):
        self.pages.discard(page)

    async def serve_request(self, asked):
        self.asked.append(asked)
        return {'ok': True}


def in_event_loop(test):
    """Run an asynchronous test."""

    @wraps(test)
    def run(*arguments, **named):
        asyncio.run(test(*arguments, **named))

    return run


def serving(element, token='', sessions=()):
    """Serve an element, or sessions; return a client."""
    jar = aiohttp.CookieJar(unsafe=True)
    return TestClient(TestServer(Server(token, element, sessions).application), cookie_jar=jar)


def own_origin(client):
    return {'Origin': str(client.make_url('')).rstrip('/')}


FOREIGN = 'http://example.com'


@pytest.mark.parametrize(
    'headers',
    [
        {},  # a client without an origin
        *({'Origin': origin} for origin in (FOREIGN, 'null', 'http://127.0.0.1:1')),
        # DNS rebinding: for the browser, the page and the server are one site
        *(
            {'Host': host, 'Origin': f'http://{host}'}
            for host in ('example.com', 'mlmem.example.com:8742', '192.0.2.1')
        ),
    ],
)
@in_event_loop
async def test_no_other_site_drives_the_element(headers):
    element = ElementStandIn()
    async with serving(element) as client:
        with pytest.raises(aiohttp.WSServerHandshakeError) as refused:
            await client.ws_connect('/live', headers=headers)
        assert refused.value.status == 403
        for path in ('/', '/about'):
            assert (await client.get(path, headers=headers)).status == (403 if headers else 200)
        assert not element.asked

        async with client.ws_connect('/live', headers=own_origin(client)) as own:
            await own.send_json({'id': 1, 'do': 'read'})
            assert unpack_frame(await own.receive_bytes())[0]['ok']
        assert element.asked == [{'id': 1, 'do': 'read'}]


@in_event_loop
async def test_no_other_site_frames_the_page():
    async with serving(ElementStandIn()) as client:
        for path in ('/', '/about', '/static/js/main.js'):
            response = await client.get(path)
            assert response.status == 200
            assert "frame-ancestors 'none'" in response.headers['Content-Security-Policy']
            assert "default-src 'self'" in response.headers['Content-Security-Policy']
            assert response.headers['Cross-Origin-Resource-Policy'] == 'same-origin'
            assert 'Access-Control-Allow-Origin' not in response.headers


@in_event_loop
async def test_public_page_requires_the_token():
    """First in the address, then in a cookie that no script can read."""
    async with serving(ElementStandIn(), token='secret') as client:
        for path in ('/', '/about', '/live', '/?token=wrong', '/static/js/main.js'):
            assert (await client.get(path)).status == 403, path
        response = await client.get('/?token=secret')
        assert response.status == 200
        assert 'token' not in str(response.url)
        cookie = response.history[0].headers['Set-Cookie']
        assert 'HttpOnly' in cookie
        assert 'SameSite=Strict' in cookie
        assert (await client.get('/about')).status == 200
        with pytest.raises(aiohttp.WSServerHandshakeError):
            await client.ws_connect('/live', headers={'Origin': FOREIGN})


@pytest.mark.parametrize('said', ['x' * 5000, 'no JSON', '[1]', '[' * 4000, b'\0\1'])
@in_event_loop
async def test_page_that_sends_nonsense_is_disconnected(said):
    element = ElementStandIn()
    async with serving(element) as client:
        async with client.ws_connect('/live', headers=own_origin(client)) as own:
            await (own.send_bytes if isinstance(said, bytes) else own.send_str)(said)
            message = await own.receive(5.0)
            assert message.type in (aiohttp.WSMsgType.CLOSE, aiohttp.WSMsgType.CLOSED)
        assert not element.asked
        assert not element.pages


@in_event_loop
async def test_slow_page_misses_pictures_but_no_news():
    """Its queue is bounded; it holds the newest picture and the newest news."""
    page = Page(max_news=64)
    for number in range(1000):
        page.set_picture(pack_frame({'picture': number}))
        page.add_news(pack_frame({'news': number}))
    found = []
    async for frame in page.iterate_frames():
        found.append(unpack_frame(frame)[0])
        if len(found) == 65:
            break
    assert found[-1] == {'picture': 999}
    assert [each['news'] for each in found[:-1]] == list(range(936, 1000))


@in_event_loop
async def test_session_is_fetched_whole_and_no_other_file():
    life = Path(__file__).parents[1] / 'data' / 'life'
    async with serving(None, sessions=[str(life)]) as client:
        response = await client.get('/sessions/0/bag.zip')
        names = zipfile.ZipFile(io.BytesIO(await response.read())).namelist()
        assert {'life/metadata.yaml', 'life/life_0.mcap'} <= set(names)
        for number in ('1', '-1', 'r0', 'x', '..%2f..', '0%2f..'):
            assert (await client.get(f'/sessions/{number}/bag.zip')).status == 404, number
        assert (await client.get('/static/../server.py')).status == 404


ACTUATOR, SCALE = ActuatorSettings(max_strain=0.08, hand_rate=1e-4), ScaleSettings(time=1e-4)


@pytest.fixture
def client():
    return Mock()


@pytest.fixture
def requests(client):
    """The requests of pages to a client that does nothing."""
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
