# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Recorded sessions in the browser."""

import base64
import re
import struct
from pathlib import Path

import pytest

DATA = Path(__file__).parent.parent / 'data'
LIFE, ABORTED = DATA / 'life', DATA / 'aborted_write'
NOW = 'mlmem.shown().sessions[0].panel.chain.state'


@pytest.fixture(scope='module')
def address(view):
    return view(str(LIFE), str(ABORTED))


@pytest.fixture
def page(browser, address):
    """Open the page of one session."""
    yield opened(browser, f'{address}?session=0')
    assert browser.complaints() == []


def opened(browser, address):
    browser.open(address)
    browser.until('window.mlmem && mlmem.shown().duration', 'a session')
    return browser


def test_a_session_is_scrubbed(page):
    """The session writes 2, reads, erases and reads."""
    levels, walls = [], []
    written = page.ask('mlmem.shown().sessions[0].events.find(e => e.ok).t')
    for time in (0.0, written + 0.02, page.ask('mlmem.shown().duration')):
        page.ask(
            "(t => { const line = document.getElementById('time'); line.value = t; "
            "line.dispatchEvent(new Event('input')); })(arguments[0])",
            time,
        )
        levels.append(page.text('.level'))
        walls.append(page.ask(f'{NOW}.walls.length'))
    assert levels == ['not read', '2', 'blank']
    assert walls == [0, 1, 0]
    assert page.text('#events li.now').endswith('blank')


def test_a_click_on_an_outcome_shows_its_moment(page):
    page.click('#events li:nth-child(2)')
    assert page.text('.level') == '2'
    assert 'delay' in page.text('.delay')


def test_an_outcome_is_reached_by_the_keyboard(page):
    from selenium.webdriver import Keys

    button = page.driver.find_element('css selector', '#events li:nth-child(2) button')
    page.ask('arguments[0].focus()', button)
    button.send_keys(Keys.ENTER)
    page.until("document.querySelector('#events [aria-current]')", 'a moment')
    assert page.ask('mlmem.shown().now') >= page.ask('mlmem.shown().times[1]')


def test_the_picture_is_zoomed_and_panned_and_tells_values(page):
    from selenium.webdriver import ActionChains
    from selenium.webdriver.common.actions.wheel_input import ScrollOrigin

    over = page.driver.find_element('css selector', '.picture .u-over')
    shown = 'mlmem.shown().sessions[0].panel.picture.range()'
    whole = page.ask(shown)
    ActionChains(page.driver).move_to_element(over).perform()
    said = page.until(lambda: page.text('.picture .tip'), 'values')
    assert re.search(r'cell 113\nΔ -?\d\.\d{4}\b', said), said
    origin = ScrollOrigin.from_element(over)
    ActionChains(page.driver).scroll_from_origin(origin, 0, -300).perform()
    near = page.until(f'(r => r[1] - r[0] < {0.9 * (whole[1] - whole[0])} && r)({shown})', 'zoom')
    assert whole[0] < near[0] < near[1] < whole[1]
    ActionChains(page.driver).drag_and_drop_by_offset(over, -80, 0).perform()
    page.until(f'{shown}[0] > {near[0]}', 'later times')
    ActionChains(page.driver).double_click(over).perform()
    page.until(f'Math.abs({shown}[1] - {whole[1]}) < 1e-9', 'all of it')


def test_it_is_played(page):
    page.ask("document.getElementById('rate').value = 10")
    page.click('#play')
    page.until('mlmem.shown().now >= mlmem.shown().duration', 'its end')
    assert page.text('#play') == 'Play'


def test_two_sessions_stand_side_by_side_with_what_differs(page, address):
    opened(page, address)
    boxes = page.ask(
        "[...document.querySelectorAll('.picture')].map(p => p.getBoundingClientRect().left)"
    )
    assert len(boxes) == 2
    assert boxes[0] < boxes[1]
    differs = page.until(lambda: page.text('#differences'), 'what differs')
    assert 'aborted' in differs
    assert 'write succeeded, level 2' in differs
    page.resize(390, 800, phone=True)
    lines = """(() => {
      const range = document.createRange();
      range.selectNodeContents(document.querySelector('#differences tr:last-child td'));
      return [range.toString(), range.getClientRects().length];
    })()"""
    assert page.ask(lines) == ['outcome', 1]  # in one piece on a phone, too
    page.resize(1320, 1100)
    scroller = "document.querySelector('#differences > div')"
    assert page.ask(f'{scroller}.clientHeight') <= 260
    assert page.ask(f'{scroller}.tabIndex') == 0


def test_a_film_is_a_webm_of_what_is_played(page):
    page.ask("document.getElementById('rate').value = 5")
    page.click('#film')
    found = page.until(lambda: list(page.downloads.glob('*.webm')), 'a film')
    page.until(lambda: found[0].stat().st_size > 5_000, 'its pictures')
    film = found[0].read_bytes()
    assert film[:4] == b'\x1a\x45\xdf\xa3'
    assert b'webm' in film[:64]
    assert b'V_VP' in film[:1024]
    at = film.index(b'\x44\x89\x88') + 3
    seconds = struct.unpack('>d', film[at : at + 8])[0] / 1000.0
    played = page.ask(
        """await (async (film) => {
          const video = document.createElement('video');
          const bytes = Uint8Array.from(atob(film), (c) => c.charCodeAt(0));
          video.src = URL.createObjectURL(new Blob([bytes]));
          await new Promise((done) => { video.onloadedmetadata = video.onerror = done; });
          return video.duration;
        })"""
        '(arguments[0])',
        base64.b64encode(film).decode(),
    )
    assert played == pytest.approx(seconds, abs=0.1)
    assert seconds > page.ask('mlmem.shown().duration') / 5.0
