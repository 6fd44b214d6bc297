# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The page is looked at in the ROS graph of test/ros, with the browser of this machine."""

import contextlib
import importlib.util
import sys
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parent))
import page_browser

_path = Path(__file__).parent.parent / 'ros' / 'conftest.py'
_spec = importlib.util.spec_from_file_location('ros_conftest', _path)
_ros = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(_ros)

pytest_pycollect_makemodule = _ros.pytest_pycollect_makemodule
driver, start_shared = _ros.driver, _ros.start_shared


@pytest.fixture(scope='module')
def view():
    """Serve a page: view(argument, ...) returns its address."""
    with contextlib.ExitStack() as stack:
        yield lambda *arguments, **options: stack.enter_context(
            page_browser.viewing(*arguments, **options)
        )


@pytest.fixture(scope='session')
def browser(tmp_path_factory):
    """The browser of this machine, one for all tests."""
    pytest.importorskip('selenium')
    binary, driver = page_browser.found()
    if binary is None or driver is None:
        pytest.skip('no Chromium with its driver (Debian: apt install chromium chromium-driver)')
    browser = page_browser.Browser(binary, driver, tmp_path_factory.mktemp('browser'))
    yield browser
    browser.driver.quit()
