# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The page's server: its files, a socket for each open page, sessions and downloads; and who may
talk to it: its own pages and, if it is open, holders of the token.
"""

from __future__ import annotations

import asyncio
import hmac
import json
import shutil
import tempfile
from collections.abc import Awaitable, Callable, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

from aiohttp import WSMsgType, web

from mlmem_ros.bag.errors import BagError

from .frames import pack_frame
from .live import Live, Page
from .session_frame import load_frame

LOOPBACK_HOSTS = ('127.0.0.1', 'localhost', '::1')

Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]


def secure_response(response: web.StreamResponse) -> None:
    """Add the headers by which no other site may frame the page, read its data, or run anything in
    it.
    """
    response.headers.update({
        'Content-Security-Policy': (
            "default-src 'self'; img-src 'self' data: blob:; media-src 'self' blob:; "
            "frame-ancestors 'none'; base-uri 'none'; form-action 'none'"
        ),
        'X-Frame-Options': 'DENY',
        'X-Content-Type-Options': 'nosniff',
        'Referrer-Policy': 'no-referrer',
        'Cross-Origin-Resource-Policy': 'same-origin',
        'Cross-Origin-Opener-Policy': 'same-origin',
        'Cache-Control': 'no-cache',
    })  # fmt: skip


def build_guard(token: str) -> Any:
    """Return the server's first handler, which checks requests before anything else sees them.

    Args:
        token: The secret to be known; empty on the loopback.
    """
    cookie = 'mlmem_view'

    def is_token(given: str) -> bool:
        return hmac.compare_digest(given.encode(), token.encode())

    @web.middleware
    async def guard_request(request: web.Request, handler: Handler) -> web.StreamResponse:
        _check_origin(request, is_local=not token)
        if token and not is_token(request.cookies.get(cookie, '')):
            if not is_token(request.query.get('token', '')):
                raise web.HTTPForbidden(text='open the address that the server has printed')
            admitted = web.HTTPSeeOther('/')  # a cookie then keeps the token out of the address
            admitted.set_cookie(cookie, token, httponly=True, samesite='Strict')
            secure_response(admitted)
            raise admitted
        response = await handler(request)
        if not response.prepared:
            secure_response(response)
        return response

    return guard_request


def _check_origin(request: web.Request, is_local: bool) -> None:
    """Refuse requests from another site, by its origin or by a foreign host name."""
    try:
        name = request.url.host or ''
    except ValueError as error:  # a port that is none
        raise web.HTTPBadRequest(text=f'Host: {error}') from error
    if is_local and name not in LOOPBACK_HOSTS:  # a foreign name that resolves to us
        raise web.HTTPForbidden(text=f'this server answers only as {", ".join(LOOPBACK_HOSTS)}')
    origin = request.headers.get('Origin')
    if origin is None:
        if request.headers.get('Upgrade', '').lower() == 'websocket':
            raise web.HTTPForbidden(text='a page sends its origin')
    elif origin != f'{request.scheme}://{request.host}':
        raise web.HTTPForbidden(text='another site must not drive the element')


class Server:
    """Serves a running element, sessions, or both, to whoever knows the token (`build_guard`)."""

    def __init__(self, token: str, live: Live | None, sessions: Sequence[str] = ()) -> None:
        self._live = live
        self._sessions = list(sessions)
        self._load = lru_cache(maxsize=4)(load_frame)
        self._static = Path(__file__).parent / 'static'
        self.application = web.Application(middlewares=[build_guard(token)])
        self.application.add_routes(
            [
                web.get('/', self._serve_page),
                web.get('/about', self._serve_about),
                web.get('/live', self._serve_socket),
                web.get('/sessions/{number}', self._serve_session),
                web.get('/sessions/{number}/bag.zip', self._serve_bag),
                web.static('/static', self._static),
            ]
        )

    async def check(self) -> None:
        """Read the sessions.

        Raises:
            BagError: One of them cannot be read.
        """
        for path in self._sessions:
            await asyncio.to_thread(self._load, path)

    # --- the page ------------------------------------------------------------------------

    async def _serve_page(self, _: web.Request) -> web.StreamResponse:
        return web.FileResponse(self._static / 'index.html')

    async def _serve_about(self, _: web.Request) -> web.StreamResponse:
        about = {'live': self._live is not None, 'sessions': len(self._sessions)}
        return web.json_response(about)

    # --- a running element ---------------------------------------------------------------

    async def _serve_socket(self, request: web.Request) -> web.StreamResponse:
        live = self._live
        if live is None:
            raise web.HTTPNotFound(text='there is no running element')
        # a ping every 10 s; messages of a page are short
        socket = web.WebSocketResponse(heartbeat=10.0, max_msg_size=4096, compress=False)
        await socket.prepare(request)
        page = live.open()
        sender = asyncio.create_task(_send_frames(request, socket, page))
        under_way = set[asyncio.Task[None]]()
        try:
            async for message in socket:
                if message.type != WSMsgType.TEXT:
                    break
                asked = _parse_request(message.data)
                if asked is None:
                    break
                task = asyncio.create_task(_serve_request(live, page, asked))
                under_way.add(task)
                task.add_done_callback(under_way.discard)
        finally:
            live.close(page)
            sender.cancel()
        return socket

    # --- sessions ------------------------------------------------------------------------

    async def _serve_session(self, request: web.Request) -> web.StreamResponse:
        path = self._find_path(request.match_info['number'])
        try:
            frame = await asyncio.to_thread(self._load, str(path))
        except BagError as error:
            raise web.HTTPNotFound(text=str(error)) from error
        return web.Response(body=frame, content_type='application/octet-stream')

    async def _serve_bag(self, request: web.Request) -> web.StreamResponse:
        path = self._find_path(request.match_info['number'])
        if not path.exists():
            raise web.HTTPNotFound(text=f'{path} is not on this machine')
        with tempfile.TemporaryDirectory() as folder:
            archive = await asyncio.to_thread(
                shutil.make_archive, f'{folder}/bag', 'zip', path.parent, path.name
            )
            file = open(archive, 'rb')  # noqa: SIM115 (the response closes it)
        name = {'Content-Disposition': f'attachment; filename="{path.name}.zip"'}
        return web.Response(body=file, headers=name, content_type='application/zip')

    def _find_path(self, number: str) -> Path:
        """Return the path of a session: one that was given, or `r0`, `r1` ... of pages."""
        recordings = self._live.requests.recordings if self._live else []
        paths = recordings if number.startswith('r') else self._sessions
        try:
            index = int(number.removeprefix('r'))
            if index < 0:
                raise IndexError
            return Path(paths[index])
        except (ValueError, IndexError):
            raise web.HTTPNotFound(text='there is no such session') from None


async def _send_frames(request: web.Request, socket: web.WebSocketResponse, page: Page) -> None:
    """Send a page its queue as fast as it reads; disconnect one that reads nothing for 10 s."""
    try:
        async for frame in page.iterate_frames():
            await asyncio.wait_for(socket.send_bytes(frame), 10.0)
    except (ConnectionError, RuntimeError):
        return
    except asyncio.TimeoutError:
        if request.transport is not None:
            request.transport.abort()  # a close message would not be read either


async def _serve_request(live: Live, page: Page, asked: dict[str, Any]) -> None:
    number, answer = asked.get('id'), await live.requests.serve_request(asked)
    head = {'k': 'answer', 'id': number if isinstance(number, int) else None, **answer}
    page.add_news(pack_frame(head))


def _parse_request(text: str) -> dict[str, Any] | None:
    try:
        asked = json.loads(text)
    except (ValueError, RecursionError):
        return None
    return asked if isinstance(asked, dict) else None


async def run_server(
    server: Server, host: str, port: int | None, ready: Callable[[int], None], over: asyncio.Event
) -> None:
    """Serve at a port until it is `over`; tell `ready` the port.

    Args:
        port: None for 8742, or any free one if that is taken.

    Raises:
        OSError: The port is not available.
    """
    runner = web.AppRunner(server.application, access_log=None, shutdown_timeout=1.0)
    await runner.setup()
    try:
        site = web.TCPSite(runner, host, 8742 if port is None else port)
        try:
            await site.start()
        except OSError:
            if port is not None:
                raise
            site = web.TCPSite(runner, host, 0)
            await site.start()
        ready(runner.addresses[0][1])
        await over.wait()
    finally:
        await runner.cleanup()
