# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The page in a headless Chromium, and its frames, for its tests and its pictures."""

import asyncio
import contextlib
import json
import queue
import shutil
import threading
import time

BROWSER_NAMES = ('chromium', 'chromium-browser', 'google-chrome')
BROWSER_OPTIONS = (
    '--headless',
    '--no-sandbox',
    '--disable-gpu',
    '--disable-quic',
    '--no-first-run',
    '--disable-background-networking',
    '--disable-component-update',
    '--disable-sync',
    '--hide-scrollbars',
    '--window-size=1320,1100',
)


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


def find_browser():
    """Return the paths of browser and driver, None for one that is missing."""
    return next(filter(None, map(shutil.which, BROWSER_NAMES)), None), shutil.which('chromedriver')


class Browser:
    """A headless Chromium with one page."""

    def __init__(self, binary, driver, profile):
        from selenium import webdriver
        from selenium.webdriver.chrome.service import Service

        options = webdriver.ChromeOptions()
        options.binary_location = binary
        for option in (*BROWSER_OPTIONS, f'--user-data-dir={profile}'):
            options.add_argument(option)
        options.set_capability('goog:loggingPrefs', {'browser': 'ALL'})
        options.add_experimental_option(
            'prefs', {'download.default_directory': str(profile / 'downloads')}
        )
        self.downloads = profile / 'downloads'
        self.driver = webdriver.Chrome(options, Service(driver))

    def resize(self, width, height, ratio=1.0, phone=False):
        """Set the size of the page in CSS pixels, each of `ratio` pixels of a picture."""
        metrics = {'width': width, 'height': height, 'deviceScaleFactor': ratio, 'mobile': phone}
        self.driver.execute_cdp_cmd('Emulation.setDeviceMetricsOverride', metrics)

    def open(self, address):
        self.driver.get(address)

    def evaluate(self, script, *arguments):
        """Return the value of a JavaScript expression."""
        return self.driver.execute_script(f'return {script}', *arguments)

    def click(self, selector):
        """Click like a user: hidden and covered elements cannot be clicked."""
        self.driver.find_element('css selector', selector).click()

    def pick(self, selector, value):
        """Choose an option by its value."""
        from selenium.webdriver.support.select import Select

        Select(self.driver.find_element('css selector', selector)).select_by_value(value)

    def text(self, selector):
        return self.driver.find_element('css selector', selector).text

    def wait_until(self, condition, what, within=40.0):
        """Wait until a JavaScript expression or a function is true; return its value."""
        deadline = time.monotonic() + within
        while True:
            value = condition() if callable(condition) else self.evaluate(condition)
            if value:
                return value
            assert time.monotonic() < deadline, f'{what}: not within {within:g} s'
            time.sleep(0.02)

    def list_complaints(self):
        """Return errors and warnings of the console since the last look."""
        return [
            entry['message']
            for entry in self.driver.get_log('browser')
            if entry['level'] in ('SEVERE', 'WARNING')
        ]
