# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A page in a headless Chromium, for tests, pictures and the check of the site."""

import shutil
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
        """Open an address."""
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
        """Return the text of an element as it is shown."""
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
