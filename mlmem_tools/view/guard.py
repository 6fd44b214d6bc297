# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Who may talk to the server: its own pages and, if it is open, holders of the token."""

from __future__ import annotations

import hmac
from collections.abc import Awaitable, Callable
from typing import Any

from aiohttp import web

LOOPBACK = ('127.0.0.1', 'localhost', '::1')
COOKIE = 'mlmem_view'

HEADERS = {
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
}
"""No other site may frame the page, read its data, or run anything in it."""

Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]


class Guard:
    """Checks requests before anything else sees them.

    Attributes:
        token: The secret to be known; empty on the loopback.
    """

    def __init__(self, token: str = '') -> None:
        self.token = token

    def middleware(self) -> Any:
        """Return the server's first handler."""

        @web.middleware
        async def guarded(request: web.Request, handler: Handler) -> web.StreamResponse:
            self._check_origin(request)
            if self.token and not self._known(request.cookies.get(COOKIE, '')):
                raise self._admitted(request)
            response = await handler(request)
            if not response.prepared:
                response.headers.update(HEADERS)
            return response

        return guarded

    def _check_origin(self, request: web.Request) -> None:
        """Refuse requests from another site, by its origin or by a foreign host name."""
        try:
            name = request.url.host or ''
        except ValueError as error:  # a port that is none
            raise web.HTTPBadRequest(text=f'Host: {error}') from error
        if not self.token and name not in LOOPBACK:  # a foreign name that resolves to us
            raise web.HTTPForbidden(text=f'this server answers only as {", ".join(LOOPBACK)}')
        origin = request.headers.get('Origin')
        if origin is None:
            if request.headers.get('Upgrade', '').lower() == 'websocket':
                raise web.HTTPForbidden(text='a page sends its origin')
        elif origin != f'{request.scheme}://{request.host}':
            raise web.HTTPForbidden(text='another site must not drive the element')

    def _known(self, token: str) -> bool:
        return hmac.compare_digest(token.encode(), self.token.encode())

    def _admitted(self, request: web.Request) -> web.HTTPSeeOther:
        """Admit a request with the token: a cookie then keeps it out of the address."""
        if not self._known(request.query.get('token', '')):
            raise web.HTTPForbidden(text='open the address that the server has printed')
        response = web.HTTPSeeOther('/')
        response.set_cookie(COOKIE, self.token, httponly=True, samesite='Strict')
        response.headers.update(HEADERS)
        return response
