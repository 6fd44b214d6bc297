# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The page in a headless Chromium, and its frames, for its tests and its pictures."""

import contextlib
import json
import shutil
import subprocess
import time

from mlmem_ros.ros.node_process import run_child_process

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
def run_view(*arguments, **streams):
    """Run `mlmem view` and yield its address; `streams` are for `subprocess.Popen`."""
    command = ['view', '--port', '0', *arguments]
    with run_child_process(
        'mlmem_tools.cli.main', command, stdout=subprocess.PIPE, text=True, **streams
    ) as it:
        yield it.stdout.readline().removeprefix('mlmem view: ').strip()


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
