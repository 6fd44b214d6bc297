# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The page of the site that runs an element in the tab: what it writes, it reads."""

import pytest
import try_page


@pytest.fixture
def opened(browser, tmp_path):
    """Open a page of the site from its folder; nothing serves it."""
    try_page.write_pages(tmp_path)
    browser.resize(1320, 1050)

    def go(address):
        browser.open(f'file://{tmp_path}/{address}')
        browser.wait_until('window.mlmem', 'a page')
        return browser

    yield go
    browser.open('about:blank')


def done(browser):
    browser.pick('#speed', '1')
    browser.wait_until('!mlmem.shown().action', 'the element is idle')
    return browser.text('#log li')


@pytest.mark.parametrize('name', ['case_2', 'kick_2'])
def test_element_in_the_tab_is_read_written_and_erased(opened, name):
    browser = opened(f'try.html?preset={name}')
    assert 'level 3, first echo after' in done(browser)
    browser.click('[data-level="1"]')
    assert 'level 1, first echo after' in done(browser)
    browser.click('[data-do="erase"]')
    assert 'blank' in done(browser)
    assert browser.text('.level') == 'blank'


def test_byte_in_the_tab_holds_any_word(opened):
    browser = opened('try.html?preset=byte')
    assert 'word 12' in done(browser)
    field = browser.driver.find_element('css selector', '.many input')
    field.clear()
    field.send_keys('0x5a')
    browser.click('.many button')  # all walls leave first
    assert 'word 90' in done(browser)
    assert browser.text('.code') == '01011010'
    browser.click('[data-level="0"]')
    assert 'word 91' in done(browser)
