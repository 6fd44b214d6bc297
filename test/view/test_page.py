# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The page in a real browser: what a user sees and does, in the order of one visit."""

import struct
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent.parent
STATE = 'mlmem.shown().state'


@pytest.fixture(scope='module')
def node(start_shared):
    """An eight-level element five times faster than by default."""
    return start_shared(parameters={'scale.time': 2e-5})


@pytest.fixture(scope='module')
def page(node, view, browser, tmp_path_factory):
    """Open the page of the running element, in a browser that has been used before."""
    browser.open('about:blank')
    browser.open(view(cwd=tmp_path_factory.mktemp('view')))
    browser.until(f'window.mlmem && {STATE}.column', 'a first picture')
    yield browser
    assert browser.complaints() == []
    browser.open('about:blank')  # the server ends before the browser does


def test_the_first_picture_costs_little_and_waits_for_no_tick(page, node):
    """From the click on a link to the first drawn cells of an element whose time stands still."""
    node.memory.pause().wait()
    page.driver.execute_cdp_cmd('Performance.enable', {'timeDomain': 'threadTicks'})
    page.driver.refresh()
    drawn = "document.querySelector('.chain')?.toDataURL().length > 3000"  # an empty one is small
    page.until(drawn, 'cells')
    took = page.driver.execute_cdp_cmd('Performance.getMetrics', {})['metrics']
    page.driver.execute_cdp_cmd('Performance.disable', {})
    node.memory.pause(False).wait()
    (processor,) = (each['value'] for each in took if each['name'] == 'ThreadTime')
    assert processor < 0.5, took


def test_a_click_on_a_defect_writes_its_level_and_the_wall_is_seen_moving(page, node):
    node.memory.pause().wait()  # or the wall might have arrived before it is seen
    page.click('[data-level="5"]')
    seen = set()

    def written():
        before = page.ask('mlmem.shown().track.end')
        node.step(25)
        page.until(f'mlmem.shown().track.end > {before}', 'a picture')
        seen.update(round(wall) for wall in page.ask(f'{STATE}.walls'))
        return page.text('.level') == '5' and page.text('.code') == '101'

    page.until(written, 'level 5')
    assert len(seen - {150}) > 1, seen  # seen on its way: it jumps two levels at a time
    node.memory.pause(False).wait()
    page.until(f'Math.abs({STATE}.walls[0] - 150) < 1', 'the wall on its defect')
    assert 0.0 < page.ask(f'{STATE}.confidence') < 1.0
    assert 'level 5' in page.text('#log li')
    assert page.ask('mlmem.shown().echo.level') == 5
    delays = page.until('mlmem.shown().delays.left', 'the delays of the levels')
    assert abs(page.ask('mlmem.shown().echo.delay') - delays[5]) < 5.0


def test_a_refusal_is_shown_beside_the_button(page):
    both = '[data-level="6"]', '[data-do="erase"]'  # at once: a write may take 50 ms here
    page.ask('arguments[0].forEach((each) => document.querySelector(each).click())', both)
    said = page.until(lambda: page.text('#bubble'), 'a refusal')
    assert 'write is running' in said
    button = page.ask("document.querySelector('[data-do=erase]').getBoundingClientRect().toJSON()")
    bubble = page.ask("document.getElementById('bubble').getBoundingClientRect().toJSON()")
    assert 0.0 <= bubble['top'] - button['bottom'] < 20.0
    assert bubble['left'] < (button['left'] + button['right']) / 2 < bubble['right']
    page.until(lambda: page.text('.level') == '6', 'what was written all the same')


def test_a_fault_is_shown_in_the_health_and_removed(page):
    page.until("document.getElementById('word').textContent !== 'connecting'", 'health')
    page.click('#stuck')
    page.until("document.getElementById('word').textContent === 'faulty'", 'a fault')
    page.until("document.getElementById('stuck').ariaPressed === 'true'", 'the pressed button')
    page.click('#health summary')
    assert 'actuator_stuck' in page.text('#parts')
    page.click('#heal')
    page.until("document.getElementById('stuck').ariaPressed === 'false'", 'a healed element')
    page.click('#health summary')


def test_time_is_paused_and_stepped(page):
    page.click('#pause')
    page.until("document.getElementById('pause').textContent === 'Run'", 'a pause')
    page.until("!document.getElementById('step').disabled", 'the button')
    page.click('#step')
    page.until(lambda: page.text('#bubble').startswith('tick '), 'the tick')
    page.click('#pause')
    page.until("document.getElementById('pause').textContent === 'Pause'", 'time that runs')


def test_time_is_slowed(page, node):
    page.pick('#speed', '0.25')
    page.until(lambda: node.memory.parameters('time.speed').wait()['time.speed'] == 0.25, 'speed')
    page.pick('#speed', '1')


def test_the_strain_is_dragged(page):
    """The substrate follows the slider, and is released by the button."""
    drag = """(() => {
      const slider = document.getElementById('strain');
      slider.value = 0.02;
      slider.dispatchEvent(new Event('input'));
      return true;
    })()"""
    page.ask(drag)
    page.until(f'Math.abs({STATE}.strain - 0.02) < 1e-3', 'the strain')
    assert 'tension' in page.text('.strain-now')
    page.click('#release')
    page.until(f'Math.abs({STATE}.strain) < 1e-3', 'no strain')


def test_a_recording_is_fetched_and_opened(page):
    page.click('#record')
    page.until(lambda: page.text('#record') == 'Stop', 'a recording')
    page.click('[data-do="read"]')
    page.until(lambda: 'read succeeded' in page.text('#log li'), 'a read')
    page.click('#record')
    page.until(lambda: 'recorded' in page.text('#log li'), 'its end')
    page.click('#log a[download]')
    (bag,) = page.until(lambda: list(page.downloads.glob('*.zip')), 'the bag')
    assert any(name.endswith('metadata.yaml') for name in zipfile.ZipFile(bag).namelist())
    link = page.driver.find_element('css selector', '#log a').get_attribute('href')
    session = f'/sessions/{link.rpartition("=")[2]}'
    assert page.ask('(await fetch(arguments[0])).status', session) == 200


def test_a_still_is_a_png_of_what_is_shown(page):
    page.click('#still')
    found = page.until(lambda: list(page.downloads.glob('*.png')), 'a still')
    data = found[0].read_bytes()
    assert data[:8] == b'\x89PNG\r\n\x1a\n'
    width, height = struct.unpack('>II', data[16:24])
    assert width > 2000
    assert height > 1000


def test_the_page_survives_the_restart_of_its_node(page, node, start_shared):
    node.terminate()
    page.until("!document.getElementById('notice').hidden", 'a word that it is gone')
    assert 'No memory node' in page.text('#notice')
    start_shared(parameters={'scale.time': 2e-5, 'design.preset': 'bits_4'})
    page.until("document.getElementById('notice').hidden", 'a word that it is back', 30.0)
    page.until(f'{STATE}.column?.length === mlmem.shown().about.rows', 'its cells')
    assert page.ask('mlmem.shown().about.levels') == 16
