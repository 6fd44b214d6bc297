# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem view`: show the element behind a running node, or recorded sessions, in a browser.

Serves a page until Ctrl-C and prints its address. Two sessions stand side by side. With
--start the command fails if its element ends. With --host other machines can
open the page by the printed address, which holds a token.
"""

from __future__ import annotations

import argparse
import asyncio
import secrets
import signal
import socket
import webbrowser
from contextlib import ExitStack
from subprocess import Popen
from typing import Any

from .command import JSON_OPTION, NODE_OPTION, declare_command, declare_option
from .output import print_failure, print_json


@declare_command(
    'show the element behind a running node, or sessions, in a browser',
    declare_option('session', nargs='*', help='one or two recorded sessions to show'),
    NODE_OPTION,
    declare_option(
        '--start',
        nargs='?',
        const='',
        metavar='ELEMENT|FILE',
        help='first start a node, of the default element unless one is given',
    ),
    declare_option(
        '--host', default='127.0.0.1', help='address to listen on; other machines need the token'
    ),
    declare_option('--port', type=int, help='port (default: 8742, or a free one)'),
    declare_option('--browser', action='store_true', help='also open the page in the browser'),
    JSON_OPTION,
    text=__doc__,
)
def view(arguments: argparse.Namespace) -> int:
    """Serve the page; return the exit status."""
    start = arguments.start is not None
    if len(arguments.session) > 2 or (arguments.session and start):
        return print_failure('view', 'give one or two sessions, or --start without any', 2)
    from mlmem.parsing import DecodeError
    from mlmem_ros.bag.errors import BagError

    try:
        ended = asyncio.run(_serve_page(arguments))
    except OSError as error:
        return print_failure(
            'view', f'cannot serve at {arguments.host}: {error.strerror or error}', 1
        )
    except DecodeError as error:
        return print_failure('view', error, 2)
    except BagError as error:
        return print_failure('view', error, 1)
    return print_failure('view', f'its node has ended with status {ended}', 1) if ended else 0


async def _serve_page(arguments: argparse.Namespace) -> int:
    """Serve the page until Ctrl-C, or the end of the node that we started; return its status."""
    from mlmem.element_file import element_path
    from mlmem_ros.contract.streams import STREAMS
    from mlmem_ros.ros.client.client import standalone
    from mlmem_ros.ros.node_process import build_node_arguments, run_node_process

    from ..view.frames import PICTURED_STREAMS
    from ..view.live import Live
    from ..view.server import LOOPBACK_HOSTS, Server, run_server

    over = asyncio.Event()
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, over.set)
    token = '' if arguments.host in LOOPBACK_HOSTS else secrets.token_urlsafe(24)

    def announce_address(port: int) -> None:
        address = _format_address(arguments.host, port, token)
        if arguments.json:
            print_json({'address': address})
        else:
            print(f'mlmem view: {address}', flush=True)
        if arguments.browser:
            webbrowser.open(address)

    async def wait_for_node(node: Popen[bytes]) -> int:
        status = await asyncio.to_thread(node.wait)
        over.set()
        return status

    with ExitStack() as stack:
        node = None
        if arguments.start is not None:
            given: dict[str, Any] = {
                str(STREAMS[name].when): 15  # 33 pictures a second
                for name in PICTURED_STREAMS
            }
            if arguments.start:
                given['element'] = element_path(arguments.start)
            started = run_node_process(build_node_arguments(arguments.node, given))
            node = loop.create_task(wait_for_node(stack.enter_context(started)))
        live = None
        if not arguments.session:
            live = Live(stack.enter_context(standalone(arguments.node)))
            stack.callback(live.end)
        server = Server(token, live, arguments.session)
        await server.check()
        await run_server(server, arguments.host, arguments.port, announce_address, over)
        return await node if node is not None and node.done() else 0


def _format_address(host: str, port: int, token: str) -> str:
    """Return the page's address; on all interfaces, with this machine's name."""
    if host in ('0.0.0.0', '::'):
        host = socket.gethostname()
    host = f'[{host}]' if ':' in host else host
    return f'http://{host}:{port}/' + (f'?token={token}' if token else '')
