# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Who may drive the element through the server, and slow pages."""

import asyncio
import io
import zipfile
from functools import wraps
from pathlib import Path

import pytest

aiohttp = pytest.importorskip('aiohttp')

from aiohttp.test_utils import TestClient, TestServer  # noqa: E402
from page_browser import unpack_frame  # noqa: E402

from mlmem_tools.view.frames import pack_frame  # noqa: E402
from mlmem_tools.view.live import Page  # noqa: E402
from mlmem_tools.view.server import Server  # noqa: E402

LIFE = Path(__file__).parent.parent / 'data' / 'life'


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


def own_origin(client):
    return {'Origin': str(client.make_url('')).rstrip('/')}


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
    async with serving(None, sessions=[str(LIFE)]) as client:
        response = await client.get('/sessions/0/bag.zip')
        names = zipfile.ZipFile(io.BytesIO(await response.read())).namelist()
        assert {'life/metadata.yaml', 'life/life_0.mcap'} <= set(names)
        for number in ('1', '-1', 'r0', 'x', '..%2f..', '0%2f..'):
            assert (await client.get(f'/sessions/{number}/bag.zip')).status == 404, number
        assert (await client.get('/static/../server.py')).status == 404
