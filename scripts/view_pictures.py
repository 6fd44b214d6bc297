# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Take the pictures of the page for the documents: a live element, and two sessions.

.venv/bin/python scripts/view_pictures.py [FOLDER]

Needs Chromium with its driver, and selenium, like the tests of the page. An element writes 5, is
erased and writes 3; then its page is taken, wide and on a phone. The recording of it is taken
beside a session of the tests.
"""

import contextlib
import os
import random
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from headless_browser import Browser, find_browser
from PIL import Image

from mlmem_lab.results import keep_picture
from mlmem_ros.ros.node_process import run_child_process

CHECKOUT_ROOT = Path(__file__).resolve().parent.parent
SESSION_BAG = CHECKOUT_ROOT / 'test' / 'data' / 'life'
DESK_SIZE, PHONE_SIZE, LONG_SIZE = (1320, 1080), (390, 800), (1320, 1240)
PIXEL_RATIO = 1.5
WRITE_RUN = 'mlmem.shown().sessions[0].runs[0]'


def main(folder: Path) -> None:
    """Take all pictures.

    Args:
        folder: Where they go.
    """
    os.environ['ROS_DOMAIN_ID'] = str(random.randint(1, 100))
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    with tempfile.TemporaryDirectory() as scratch:
        browser = Browser(*find_browser(), Path(scratch))
        session = Path(scratch) / 'rewritten'
        try:
            take_live_pictures(browser, folder, session)
            take_session_picture(browser, folder, session)
        finally:
            browser.driver.quit()


@contextlib.contextmanager
def run_view(*sessions: str) -> Iterator[str]:
    """Run `mlmem view` of sessions, or of the running element; yield its address."""
    command = ['view', '--port', '0', *sessions]
    with run_child_process(
        'mlmem_tools.cli.main', command, stdout=subprocess.PIPE, text=True
    ) as process:
        yield process.stdout.readline().removeprefix('mlmem view: ').strip()


def take_live_pictures(browser: Browser, folder: Path, session: Path) -> None:
    """Take a running element, which records a session."""
    command = [sys.executable, '-m', 'mlmem_ros.ros.main', '--ros-args']
    node = subprocess.Popen([*command, '-p', f'record.path:={session}'])
    try:
        with run_view() as address:
            browser.resize(*DESK_SIZE, PIXEL_RATIO)
            browser.open(address)
            browser.wait_until('window.mlmem && mlmem.shown().state.column', 'an element', 30.0)
            for control in ('[data-level="5"]', '[data-do="erase"]', '[data-level="3"]'):
                browser.click(control)
                time.sleep(0.5)
                browser.wait_until('!mlmem.shown().state.doing', control, 60.0)
            browser.click('#record')  # stop
            time.sleep(3.5)  # the answer disappears
            calm = "document.getElementById('health').classList.contains('good')"
            browser.wait_until(calm, 'a healthy element', 120.0)
            save_picture(browser, folder / 'view.png', 'light')
            save_picture(browser, folder / 'view_dark.png', 'dark')
            browser.wait_until(calm, 'a healthy element', 120.0)
            browser.resize(*PHONE_SIZE, 2.0, phone=True)
            save_picture(browser, folder / 'view_phone.png', 'light')
    finally:
        node.terminate()
        node.wait(20.0)


def take_session_picture(browser: Browser, folder: Path, session: Path) -> None:
    """Take two sessions side by side, at a time while both run a procedure."""
    with run_view(str(session), str(SESSION_BAG)) as address:
        browser.resize(*LONG_SIZE, PIXEL_RATIO)
        browser.open(address)
        browser.wait_until('window.mlmem && mlmem.shown().duration', 'two sessions')
        browser.evaluate(
            f'(({{ from, to }}) => mlmem.shown().seek((from + 3 * to) / 4))({WRITE_RUN})'
        )
        save_picture(browser, folder / 'view_sessions.png', 'light')


def save_picture(browser: Browser, path: Path, theme: str) -> None:
    """Save the page as it is."""
    if browser.evaluate('document.documentElement.dataset.theme') != theme:
        browser.evaluate("document.getElementById('theme').click()")
    time.sleep(0.5)
    browser.driver.save_screenshot(str(path))
    Image.open(path).convert('RGB').save(path, optimize=True)
    keep_picture(
        path, 'scripts/view_pictures.py', ['scripts/view_pictures.py', 'mlmem_tools/view']
    )


if __name__ == '__main__':
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else CHECKOUT_ROOT / 'docs' / 'images')
