# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The page of the site that runs an element in the tab: what it writes, it reads."""

import pytest
import try_page


@pytest.fixture
def opened(browser, tmp_path):
    """Open a page of the site from its folder; nothing serves it."""
    try_page.write(tmp_path)
    browser.resize(1320, 1050)

    def go(address):
        browser.open(f'file://{tmp_path}/{address}')
        browser.until('window.mlmem', 'a page')
        return browser

    yield go
    browser.open('about:blank')


def done(browser):
    browser.pick('#speed', '1')
    browser.until('!mlmem.shown().action', 'the element is idle')
    return browser.text('#log li')


@pytest.mark.parametrize('name', ['case_2', 'kick_2'])
def test_an_element_in_the_tab_is_read_written_and_erased(opened, name):
    browser = opened(f'try.html?preset={name}')
    assert 'level 3, first echo after' in done(browser)
    browser.click('[data-level="1"]')
    assert 'level 1, first echo after' in done(browser)
    browser.click('[data-do="erase"]')
    assert 'blank' in done(browser)
    assert browser.text('.level') == 'blank'


def test_a_byte_in_the_tab_holds_any_word(opened):
    browser = opened('try.html?preset=byte')
    assert 'word 12' in done(browser)
    browser.click('#word')  # 90, which needs all walls out first
    assert 'word 90' in done(browser)
    assert browser.text('.code') == '01011010'
    browser.click('[data-level="0"]')
    assert 'word 91' in done(browser)


def test_a_recorded_session_opens_without_a_server(opened):
    browser = opened('session.html')
    browser.until('mlmem.shown().duration', 'a session')
    assert 'write 2' in browser.text('#events')
    assert browser.text('#facts').startswith('session: 8 levels')


def test_a_picture_becomes_an_element(browser, tmp_path):
    """The script of the site's first page."""
    try_page.write(tmp_path)
    script = (try_page.ROOT / 'docs/_static/operate.js').read_text(encoding='utf-8')
    picture = '<a class="operate" href="try.html">a picture</a>'
    (tmp_path / 'index.html').write_text(f'{picture}<script>{script}</script>', encoding='utf-8')
    browser.open(f'file://{tmp_path}/index.html')
    browser.click('a.operate')
    browser.driver.switch_to.frame(0)
    browser.until('window.mlmem', 'an element')
    assert 'level 3' in done(browser)
    browser.driver.switch_to.default_content()
    browser.open('about:blank')
