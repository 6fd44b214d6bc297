# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The page's server and frames, for its tests."""

import asyncio
import contextlib
import json
import queue
import threading


@contextlib.contextmanager
def serve_page(*sessions):
    """Serve sessions, or else the element, from a thread of its own; yield the address."""
    from mlmem_ros.ros.client.client import standalone
    from mlmem_tools.view.live import Live
    from mlmem_tools.view.server import Server, run_server

    started = queue.Queue()

    async def serve():
        over, loop = asyncio.Event(), asyncio.get_running_loop()
        with contextlib.ExitStack() as stack:
            live = None
            if not sessions:
                live = Live(stack.enter_context(standalone('/mlmem')))
                stack.callback(live.end)

            def announce(port):
                started.put((port, lambda: loop.call_soon_threadsafe(over.set)))

            await run_server(Server('', live, sessions), '127.0.0.1', 0, announce, over)

    thread = threading.Thread(target=lambda: asyncio.run(serve()))
    thread.start()
    port, end = started.get(timeout=60.0)
    yield f'http://127.0.0.1:{port}/'
    end()
    thread.join()


def unpack_frame(frame):
    """Return the header of a frame for a page, and its body."""
    length = int.from_bytes(frame[:4], 'little')
    return json.loads(frame[4 : 4 + length]), frame[4 + length :]
