# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Take the pictures of the page for the documents: a live element, and two sessions.

.venv/bin/python scripts/view_pictures.py [FOLDER]

Needs Chromium with its driver, and selenium, like the tests of the page. An element writes 5, is
erased and writes 3; then its page is taken, wide and on a phone. The recording of it is taken
beside a session of the tests.
"""

import os
import random
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from PIL import Image

from mlmem_lab.results import keep_picture

ROOT = Path(__file__).resolve().parent.parent
sys.path.append(str(ROOT / 'test' / 'view'))

from page_browser import Browser, found, viewing  # noqa: E402

LIFE = ROOT / 'test' / 'data' / 'life'
DESK, PHONE, LONG = (1320, 1080), (390, 800), (1320, 1240)
RATIO = 1.5
WRITE = 'mlmem.shown().sessions[0].runs[0]'


def main(folder: Path) -> None:
    """Take all pictures.

    Args:
        folder: Where they go.
    """
    os.environ['ROS_DOMAIN_ID'] = str(random.randint(1, 100))
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    with tempfile.TemporaryDirectory() as scratch:
        browser = Browser(*found(), Path(scratch))
        session = Path(scratch) / 'rewritten'
        try:
            live(browser, folder, session)
            sessions(browser, folder, session)
        finally:
            browser.driver.quit()


def live(browser: Browser, folder: Path, session: Path) -> None:
    """Take a running element, which records a session."""
    command = [sys.executable, '-m', 'mlmem_ros.ros.main', '--ros-args']
    node = subprocess.Popen([*command, '-p', f'record.path:={session}'])
    try:
        with viewing() as address:
            browser.resize(*DESK, RATIO)
            browser.open(address)
            browser.until('window.mlmem && mlmem.shown().state.column', 'an element', 30.0)
            for control in ('[data-level="5"]', '[data-do="erase"]', '[data-level="3"]'):
                browser.click(control)
                time.sleep(0.5)
                browser.until('!mlmem.shown().state.doing', control, 60.0)
            browser.click('#record')  # stop
            time.sleep(3.5)  # the answer disappears
            calm = "document.getElementById('health').classList.contains('good')"
            browser.until(calm, 'a healthy element', 120.0)
            take(browser, folder / 'view.png', 'light')
            take(browser, folder / 'view_dark.png', 'dark')
            browser.until(calm, 'a healthy element', 120.0)
            browser.resize(*PHONE, 2.0, phone=True)
            take(browser, folder / 'view_phone.png', 'light')
    finally:
        node.terminate()
        node.wait(20.0)


def sessions(browser: Browser, folder: Path, session: Path) -> None:
    """Take two sessions side by side, at a time while both run a procedure."""
    with viewing(str(session), str(LIFE)) as address:
        browser.resize(*LONG, RATIO)
        browser.open(address)
        browser.until('window.mlmem && mlmem.shown().duration', 'two sessions')
        browser.ask(f'(({{ from, to }}) => mlmem.shown().seek((from + 3 * to) / 4))({WRITE})')
        take(browser, folder / 'view_sessions.png', 'light')


def take(browser: Browser, path: Path, theme: str) -> None:
    """Save the page as it is."""
    if browser.ask('document.documentElement.dataset.theme') != theme:
        browser.ask("document.getElementById('theme').click()")
    time.sleep(0.5)
    browser.driver.save_screenshot(str(path))
    Image.open(path).convert('RGB').save(path, optimize=True)
    keep_picture(
        path, 'scripts/view_pictures.py', ['scripts/view_pictures.py', 'mlmem_tools/view']
    )


if __name__ == '__main__':
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / 'docs' / 'images')
