# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Pages without a node in the browser: recorded sessions, and an element that runs in the tab."""

from pathlib import Path

import pytest
import try_page
from page_browser import serve_page

DATA = Path(__file__).parent.parent / 'data'


@pytest.fixture
def session_page():
    """The address of a page of two sessions."""
    with serve_page(str(DATA / 'life'), str(DATA / 'aborted_write')) as address:
        yield address


@pytest.fixture
def page(browser):
    """The browser, whose page must not complain."""
    yield browser
    assert browser.list_complaints() == []
    browser.open('about:blank')


def test_session_page_is_scrubbed_and_played(page, session_page):
    """Two sessions stand side by side. The first one writes 2, reads, erases and reads."""
    page.open(session_page)
    page.wait_until('window.mlmem && mlmem.shown().duration', 'two sessions')
    left, right = page.evaluate(
        "[...document.querySelectorAll('.picture')].map(p => p.getBoundingClientRect().left)"
    )
    assert left < right

    page.open(f'{session_page}?session=0')
    page.wait_until('window.mlmem && mlmem.shown().duration', 'one session')
    levels, walls = [], []
    written = page.evaluate('mlmem.shown().sessions[0].events.find(e => e.ok).t')
    for time in (0.0, written + 0.02, page.evaluate('mlmem.shown().duration')):
        page.evaluate(
            "(t => { const line = document.getElementById('time'); line.value = t; "
            "line.dispatchEvent(new Event('input')); })(arguments[0])",
            time,
        )
        levels.append(page.text('.level'))
        walls.append(page.evaluate('mlmem.shown().sessions[0].panel.chain.state.walls.length'))
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


def test_element_in_the_tab_is_read_written_and_erased(page, tmp_path):
    """Opened from its folder: nothing serves it. An element is chosen, by the address or the list;
    what was written is read at once. The register's walls leave before others come.
    """
    try_page.write_pages(tmp_path)

    def get_last_event():
        page.evaluate('void Object.assign(mlmem.shown(), { speed: 10, paused: false })')
        page.wait_until('!mlmem.shown().action', 'the element is idle')
        page.evaluate('mlmem.shown().paused = true')
        return page.text('#log li')

    page.open(f'file://{tmp_path}/try.html?preset=case_2')
    page.wait_until('window.mlmem', 'a page')
    assert 'level 3, first echo after' in get_last_event()
    page.click('[data-level="4"]')  # a step under strain
    assert 'level 4, first echo after' in get_last_event()

    page.pick('#preset', 'kick_2')
    assert 'level 3, first echo after' in get_last_event()
    page.click('[data-do="erase"]')
    assert 'blank' in get_last_event()
    assert page.text('.level') == 'blank'
    page.click('[data-level="1"]')
    assert 'level 1, first echo after' in get_last_event()

    page.pick('#preset', 'byte')
    assert 'word 12' in get_last_event()
    field = page.driver.find_element('css selector', '.many input')
    field.clear()
    field.send_keys('0x5a')
    page.click('.many button')
    assert 'word 90' in get_last_event()
    assert page.text('.code') == '01011010'
    page.click('[data-level="0"]')
    assert 'word 91' in get_last_event()
