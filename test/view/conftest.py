# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The browser of this machine."""

import pytest
from headless_browser import Browser, find_browser


@pytest.fixture(scope='session')
def browser(tmp_path_factory):
    """The browser of this machine, one for all tests."""
    pytest.importorskip('selenium')
    binary, driver = find_browser()
    if binary is None or driver is None:
        pytest.skip('no Chromium with its driver (Debian: apt install chromium chromium-driver)')
    browser = Browser(binary, driver, tmp_path_factory.mktemp('browser'))
    yield browser
    browser.driver.quit()
