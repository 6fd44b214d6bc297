# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The page server, and the browser of this machine."""

import asyncio
import contextlib
import queue
import threading

import page_browser
import pytest

from mlmem_ros.ros.client.client import standalone


@contextlib.contextmanager
def serve_page(sessions):
    """Serve sessions, or else the element, from a thread of its own; yield the address."""
    pytest.importorskip('aiohttp')
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


@pytest.fixture(scope='module')
def view(tmp_path_factory):
    """Serve a page: view(session, ...) returns its address."""
    with contextlib.ExitStack() as stack:
        stack.enter_context(pytest.MonkeyPatch.context()).chdir(tmp_path_factory.mktemp('view'))
        yield lambda *sessions: stack.enter_context(serve_page(sessions))


@pytest.fixture(scope='session')
def browser(tmp_path_factory):
    """The browser of this machine, one for all tests."""
    pytest.importorskip('selenium')
    binary, driver = page_browser.find_browser()
    if binary is None or driver is None:
        pytest.skip('no Chromium with its driver (Debian: apt install chromium chromium-driver)')
    browser = page_browser.Browser(binary, driver, tmp_path_factory.mktemp('browser'))
    yield browser
    browser.driver.quit()
