# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The page in a real browser: what a user sees and does, in the order of one visit."""

import dataclasses
import re
import struct
import time
import zipfile
from pathlib import Path

import pytest

from mlmem import Faults

ROOT = Path(__file__).parent.parent.parent
STATE = 'mlmem.shown().state'
GIVEN = {'scale.time': 2e-5} | {
    f'publish.{stream}_every': 20 for stream in ('field', 'wall', 'joint_states')
}


@pytest.fixture(scope='module')
def node(start_shared):
    """An eight-level element with streams at the default rates."""
    return start_shared(GIVEN)


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
    assert len(seen - {54}) > 1, seen  # seen on its way: it jumps two levels at a time
    node.memory.pause(False).wait()
    page.until(f'Math.abs({STATE}.walls[0] - 54) < 1', 'the wall on its defect')
    assert 0.0 < page.ask(f'{STATE}.confidence') < 1.0
    assert 'level 5' in page.text('#log li')
    assert page.ask('mlmem.shown().echo.level') == 5
    delays = page.until('mlmem.shown().delays.right', 'the delays of the levels')
    assert abs(page.ask('mlmem.shown().echo.delay') - delays[5]) < 5.0


def test_a_refusal_is_shown_beside_the_button(page, node):
    both = '[data-level="6"]', '[data-do="erase"]'
    node.memory.pause().wait()  # or the write might be over before the other is heard
    page.ask('arguments[0].forEach((each) => document.querySelector(each).click())', both)
    said = page.until(lambda: node.step(1) and page.text('#bubble'), 'a refusal')
    node.memory.pause(False).wait()
    assert 'write is running' in said
    button = page.ask("document.querySelector('[data-do=erase]').getBoundingClientRect().toJSON()")
    bubble = page.ask("document.getElementById('bubble').getBoundingClientRect().toJSON()")
    assert 0.0 <= bubble['top'] - button['bottom'] < 20.0
    assert bubble['left'] < (button['left'] + button['right']) / 2 < bubble['right']
    page.until(lambda: page.text('.level') == '6', 'what was written all the same')


def test_a_fault_is_shown_in_the_health_and_removed(page):
    page.until("document.getElementById('word').textContent !== 'connecting'", 'health')
    page.click('[data-fault="actuator_stuck"]')
    page.until("document.getElementById('word').textContent === 'faulty'", 'a fault')
    button = "document.querySelector('[data-fault=actuator_stuck]')"
    page.until(f"{button}.ariaPressed === 'true'", 'the pressed button')
    page.click('#health summary')
    assert 'actuator_stuck' in page.text('#parts')
    page.click('#heal')
    page.until(f"{button}.ariaPressed === 'false'", 'a healed element')
    page.click('#health summary')


def test_every_fault_of_the_table_has_a_control(page, node):
    """A number is set by its field, and one out of its range refused and put back."""
    shown = page.ask("[...document.querySelectorAll('[data-fault]')].map((e) => e.dataset.fault)")
    assert sorted(shown) == sorted(field.name for field in dataclasses.fields(Faults))

    def enter(value):
        page.ask(
            "((e) => { e.value = arguments[0]; e.dispatchEvent(new Event('change')); })"
            "(document.querySelector('[data-fault=sensor_noise]'))".replace('arguments[0]', value)
        )

    enter('1e-5')
    noise = 'faults.sensor_noise'
    page.until(lambda: node.memory.parameters(noise).wait() == {noise: 1e-5}, 'noise')
    page.until(
        "document.querySelector('#numbers .present')?.innerText.trim() === 'sensor noise'",
        'a word',
    )
    enter('5')
    assert 'sensor_noise must be' in page.until(lambda: page.text('#bubble'), 'a refusal')
    page.until("document.querySelector('[data-fault=sensor_noise]').value === '0.00001'", 'again')
    page.ask("document.getElementById('bubble').hidden = true")
    page.click('#heal')
    page.until("!document.querySelector('#numbers .present')", 'a healed element')


def test_locate_tells_the_place_and_the_number_of_walls(page, node):
    node.memory.write(6).wait()
    page.click('[data-do="locate"]')
    said = page.until(lambda: 'locate' in (it := page.text('#log li')) and it, 'an answer')
    assert re.search(r'locate succeeded: 1 wall, at cell 6[23]\.\d\d ± \d\.\d\d$', said), said


def test_a_self_test_shows_its_checks(page):
    page.click('[data-do="self_test"]')
    page.until("document.querySelectorAll('#log .checks .good').length >= 11", 'checks', 90.0)
    assert not page.ask("document.querySelectorAll('#log .checks .bad').length")
    assert 'level 7' in page.text('#log .checks')


def test_a_reset_asks_before_it_acts(page, node):
    before = node.memory.write(5).wait().level
    page.click('[data-do="reset"]')
    assert 'is lost' in page.until(lambda: page.text('#ask'), 'a question')
    page.click('#ask button')
    page.until("!document.getElementById('ask').open", 'the end of it')
    assert node.memory.read().wait().level == before
    page.click('[data-do="reset"]')
    page.click('#ask .danger')
    page.until(lambda: page.text('.level') == 'blank', 'a fresh element')


CONTRAST = """
(selector) => {
  const numbers = (colour) => {
    const found = colour.match(/[-\\d.]+/g).map(Number);
    return colour.startsWith('rgb') ? [...found.slice(0, 3).map((v) => v / 255), found[3] ?? 1] : [...found.slice(0, 3), found[3] ?? 1];
  };
  const over = ([r, g, b, a], under) => [r, g, b].map((v, i) => a * v + (1 - a) * under[i]);
  const ground = (element) => {
    if (!element) return [1, 1, 1];
    const own = numbers(getComputedStyle(element).backgroundColor);
    return own[3] === 1 ? own.slice(0, 3) : over(own, ground(element.parentElement));
  };
  const light = (colour) => colour.map((v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4))
    .reduce((sum, v, i) => sum + v * [0.2126, 0.7152, 0.0722][i], 0);
  const element = document.querySelector(selector), under = ground(element);
  const [low, high] = [light(over(numbers(getComputedStyle(element).color), under)), light(under)].sort((a, b) => a - b);
  return (high + 0.05) / (low + 0.05);
}
"""  # noqa: E501


@pytest.mark.parametrize('theme', ['light', 'dark'])
def test_words_stand_out_from_their_ground(page, theme):
    """By 4.5, as WCAG 2.2 AA asks for small text: badges, bubbles and their links, muted words."""
    page.ask(f"document.documentElement.dataset.theme = '{theme}'")
    show = (
        "((good) => { const it = document.getElementById('bubble'); it.hidden = false;"
        "it.innerHTML = 'a <a href=\"/\">link</a>'; it.classList.toggle('good', good); })"
    )
    found = {}
    for tone in ('', 'good', 'warn', 'bad'):
        page.ask(f"document.getElementById('health').className = 'health {tone}'")
        found['badge', tone] = page.ask(f"({CONTRAST})('#word')")
    for good in ('true', 'false'):
        page.ask(f'{show}({good})')
        found['bubble', good] = page.ask(f"({CONTRAST})('#bubble')")
        found['link', good] = page.ask(f"({CONTRAST})('#bubble a')")
    for words in ('#facts', '.title', '.hint'):
        found[words] = page.ask(f"({CONTRAST})('{words}')")
    page.ask("document.getElementById('bubble').hidden = true")
    page.ask("document.documentElement.dataset.theme = 'light'")
    assert {words: ratio for words, ratio in found.items() if ratio < 4.5} == {}


def test_pictures_have_names_and_the_content_is_announced(page):
    nameless = "[...document.querySelectorAll('canvas')].filter((e) => !e.ariaLabel)"
    page.until(f'{nameless}.length === 0', 'names')
    assert page.ask("document.querySelector('.held').getAttribute('role')") == 'status'


def test_a_still_element_is_not_painted(page):
    """The chain not at all, and no part of the page is laid out at the rate of the screen."""
    page.until('!mlmem.shown().state.doing', 'an idle element')
    page.driver.execute_cdp_cmd('Performance.enable', {})
    page.ask('(window.painted = 0, mlmem.shown().panel.chain.drawCells = () => { painted++; })')

    def layouts():
        found = page.driver.execute_cdp_cmd('Performance.getMetrics', {})['metrics']
        return next(each['value'] for each in found if each['name'] == 'LayoutCount')

    before, began = layouts(), time.monotonic()
    time.sleep(1.5)
    rate = (layouts() - before) / (time.monotonic() - began)
    page.driver.execute_cdp_cmd('Performance.disable', {})
    painted = page.ask('painted')
    page.ask('delete mlmem.shown().panel.chain.drawCells')
    assert painted == 0
    assert rate < 15.0  # 60 with anything that is animated


def test_the_strain_axis_has_numbers(page):
    """A round one of either sign beside 0, whatever the largest strain in view."""
    script = """(async () => {
      const { about0 } = await import('/static/js/plot.js');
      return [0.01, 0.012, 0.0345, 0.08, 0.5].map(about0);
    })()"""
    found = page.ask(f'await {script}')
    assert [high for _, _, high in found] == pytest.approx([0.01, 0.01, 0.02, 0.05, 0.5])
    assert all(low == -high and zero == 0 for low, zero, high in found)


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
    def whole():
        """A browser makes the file first, and writes it then."""
        found = [each.read_bytes() for each in page.downloads.glob('*.png')]
        return next((each for each in found if each.endswith(b'IEND\xaeB`\x82')), None)

    page.click('#still')
    data = page.until(whole, 'a still')
    assert data[:8] == b'\x89PNG\r\n\x1a\n'
    width, height = struct.unpack('>II', data[16:24])
    assert width > 2000
    assert height > 1000


def test_the_page_survives_the_restart_of_its_node_as_a_byte(page, node, start_shared):
    """Its words are read by waveforms: there is no threshold, and a level has no delay."""
    node.terminate()
    page.until("!document.getElementById('notice').hidden", 'a word that it is gone')
    assert 'No memory node' in page.text('#notice')
    byte = start_shared(GIVEN | {'element': 'byte'})
    page.until("document.getElementById('notice').hidden", 'a word that it is back', 30.0)
    page.until('mlmem.shown().about.words === 256', 'its cells')
    assert page.text('#facts').startswith('8 levels, 256 words, 225 cells')
    byte.memory.write(0b01000010).wait()
    page.click('[data-do="locate"]')
    said = page.until(lambda: 'locate' in (it := page.text('#log li')) and it, 'an answer')
    assert said.endswith('locate succeeded: 2 walls, at cells 50, 175')
    assert page.ask('mlmem.shown().about.probes.left.threshold') is None
    assert page.ask('mlmem.shown().about.carriers') == {'pulse': 1.7}
