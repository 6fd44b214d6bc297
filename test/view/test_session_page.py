# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Recorded sessions in the browser."""

from pathlib import Path

import pytest

DATA = Path(__file__).parent.parent / 'data'
LIFE, ABORTED = DATA / 'life', DATA / 'aborted_write'
NOW = 'mlmem.shown().sessions[0].panel.chain.state'


@pytest.fixture
def open_page(browser, view):
    """Open the page of two sessions with a query."""
    address = view(str(LIFE), str(ABORTED))

    def open_page(query=''):
        browser.open(address + query)
        browser.wait_until('window.mlmem && mlmem.shown().duration', 'a session')
        return browser

    yield open_page
    assert browser.list_complaints() == []


def test_session_page_is_scrubbed_and_played(open_page):
    """The session writes 2, reads, erases and reads."""
    page, levels, walls = open_page('?session=0'), [], []
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
    page.click('#events li:nth-child(2)')
    assert page.text('.level') == '2'
    assert 'delay' in page.text('.delay')
    page.evaluate("document.getElementById('rate').value = 10")
    page.click('#play')
    page.wait_until('mlmem.shown().now >= mlmem.shown().duration', 'its end')
    assert page.text('#play') == 'Play'


def test_two_sessions_stand_side_by_side(open_page):
    left, right = open_page().evaluate(
        "[...document.querySelectorAll('.picture')].map(p => p.getBoundingClientRect().left)"
    )
    assert left < right
