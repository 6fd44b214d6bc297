# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Recorded sessions in the browser."""

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
    assert browser.list_complaints() == []


def opened(browser, address):
    browser.open(address)
    browser.wait_until('window.mlmem && mlmem.shown().duration', 'a session')
    return browser


def test_session_page_is_scrubbed(page):
    """The session writes 2, reads, erases and reads."""
    levels, walls = [], []
    written = page.evaluate('mlmem.shown().sessions[0].events.find(e => e.ok).t')
    for time in (0.0, written + 0.02, page.evaluate('mlmem.shown().duration')):
        page.evaluate(
            "(t => { const line = document.getElementById('time'); line.value = t; "
            "line.dispatchEvent(new Event('input')); })(arguments[0])",
            time,
        )
        levels.append(page.text('.level'))
        walls.append(page.evaluate(f'{NOW}.walls.length'))
    assert levels == ['not read', '2', 'blank']
    assert walls == [0, 1, 0]
    assert page.text('#events li.now').endswith('blank')


def test_click_on_an_outcome_shows_its_moment(page):
    page.click('#events li:nth-child(2)')
    assert page.text('.level') == '2'
    assert 'delay' in page.text('.delay')


def test_session_page_is_played(page):
    page.evaluate("document.getElementById('rate').value = 10")
    page.click('#play')
    page.wait_until('mlmem.shown().now >= mlmem.shown().duration', 'its end')
    assert page.text('#play') == 'Play'


def test_two_sessions_stand_side_by_side(page, address):
    opened(page, address)
    boxes = page.evaluate(
        "[...document.querySelectorAll('.picture')].map(p => p.getBoundingClientRect().left)"
    )
    assert len(boxes) == 2
    assert boxes[0] < boxes[1]
