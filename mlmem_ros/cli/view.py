# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem view`: the element behind a running node in a browser, or recorded sessions.

Serves one page on this machine and prints its address, until Ctrl-C. With a session it shows
that one, with two sessions both side by side and what differs. With --host the page can be seen
from other machines, by whoever has the address with the token in it.
"""

from __future__ import annotations

import argparse
import asyncio
import secrets
import signal
import sys
from contextlib import ExitStack
from typing import TYPE_CHECKING

from .console import complain

if TYPE_CHECKING:
    from ..view.live import Live

SUMMARY = 'show the element behind a running node, or sessions, in a browser'


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of this sub-command."""
    parser.add_argument('session', nargs='*', help='one or two recorded sessions to show instead')
    parser.add_argument('--node', default='mlmem', help='name of the memory node')
    parser.add_argument(
        '--host', default='127.0.0.1', help='address to listen at; others may look with a token'
    )
    parser.add_argument('--port', type=int, help='port (default: 8742, or a free one)')
    parser.add_argument('--browser', action='store_true', help='open the page in the browser, too')
    parser.add_argument(
        '--until-eof', action='store_true', help='end with the standard input, as a child does'
    )


def run(arguments: argparse.Namespace) -> int:
    """Serve the page; return the exit status."""
    if len(arguments.session) > 2:
        complain('view', f'session: one or two can be shown; got {len(arguments.session)}')
        return 2
    try:
        asyncio.run(_serve(arguments))
    except OSError as error:
        complain('view', f'cannot serve at {arguments.host}: {error.strerror or error}')
        return 1
    except RuntimeError as error:
        complain('view', error)
        return 1
    return 0


async def _serve(arguments: argparse.Namespace) -> None:
    from ..bag import BagError
    from ..view.guard import LOOPBACK, Guard
    from ..view.recorded import load
    from ..view.server import Server, serve

    for path in arguments.session:
        try:
            await asyncio.to_thread(load, path)
        except BagError as error:
            raise RuntimeError(str(error)) from error
    over = asyncio.Event()
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, over.set)
    if arguments.until_eof:
        loop.add_reader(sys.stdin, lambda: sys.stdin.buffer.read1(1) or over.set())
    token = '' if arguments.host in LOOPBACK else secrets.token_urlsafe(24)

    def ready(port: int) -> None:
        host = f'[{arguments.host}]' if ':' in arguments.host else arguments.host
        address = f'http://{host}:{port}/' + (f'?token={token}' if token else '')
        print(f'mlmem view: {address}', flush=True)
        if arguments.browser:
            import webbrowser

            webbrowser.open(address)

    with ExitStack() as stack:
        live = None if arguments.session else _live(arguments.node, stack)
        server = Server(Guard(token), live, arguments.session)
        await serve(server, arguments.host, arguments.port, ready, over)


def _live(node: str, stack: ExitStack) -> Live:
    from ..ros.client.standalone import standalone
    from ..view.live import Live

    live = Live(stack.enter_context(standalone(node)))
    stack.callback(live.end)
    return live
