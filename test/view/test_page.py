# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Pages in a real browser: recorded sessions, an element that runs in the tab, and a running node,
of which it is what a user sees and does, in the order of one visit.
"""

import asyncio
import contextlib
import queue
import threading
import zipfile
from pathlib import Path

import pytest
import try_page
from headless_browser import Browser, find_browser

DATA = Path(__file__).parent.parent / 'data'
STATE = 'mlmem.shown().state'
GIVEN = {'scale.time': 2e-5, 'queue.most': 0} | {
    f'publish.{stream}_every': 20 for stream in ('field', 'wall', 'joint_states')
}


@pytest.fixture(scope='module')
def browser(tmp_path_factory):
    """The browser of this machine, one for all tests."""
    pytest.importorskip('selenium')
    binary, driver = find_browser()
    if binary is None or driver is None:
        pytest.skip('no Chromium with its driver (Debian: apt install chromium chromium-driver)')
    browser = Browser(binary, driver, tmp_path_factory.mktemp('browser'))
    yield browser
    browser.driver.quit()


@contextlib.contextmanager
def serve_page(*sessions):
    """Serve sessions, or else the element, from a thread of its own; yield the address."""
    from mlmem_ros.ros.client.client import standalone
    from mlmem_tools.view.live import Live
    from mlmem_tools.view.server import Server, run_server

    started = queue.Queue()

    async def serve():
        over, loop = asyncio.Event(), asyncio.get_running_loop()
        with contextlib.ExitStack() as stack:
            live = None
            if not sessions:
                live = Live(stack.enter_context(standalone('/mlmem')))
                stack.callback(live.end)

            def announce(port):
                started.put((port, lambda: loop.call_soon_threadsafe(over.set)))

            await run_server(Server('', live, sessions), '127.0.0.1', 0, announce, over)

    thread = threading.Thread(target=lambda: asyncio.run(serve()))
    thread.start()
    port, end = started.get(timeout=60.0)
    yield f'http://127.0.0.1:{port}/'
    end()
    thread.join()


@pytest.fixture
def session_page():
    """The address of a page of two sessions."""
    with serve_page(str(DATA / 'life'), str(DATA / 'aborted_write')) as address:
        yield address


@pytest.fixture
def tab(browser):
    """The browser, whose page must not complain."""
    yield browser
    assert browser.list_complaints() == []
    browser.open('about:blank')


def test_session_page_is_scrubbed_and_played(tab, session_page):
    """Two sessions stand side by side. The first one writes 2, reads, erases and reads."""
    tab.open(session_page)
    tab.wait_until('window.mlmem && mlmem.shown().duration', 'two sessions')
    left, right = tab.evaluate(
        "[...document.querySelectorAll('.picture')].map(p => p.getBoundingClientRect().left)"
    )
    assert left < right

    tab.open(f'{session_page}?session=0')
    tab.wait_until('window.mlmem && mlmem.shown().duration', 'one session')
    levels, walls = [], []
    written = tab.evaluate('mlmem.shown().sessions[0].events.find(e => e.ok).t')
    for time in (0.0, written + 0.02, tab.evaluate('mlmem.shown().duration')):
        tab.evaluate(
            "(t => { const line = document.getElementById('time'); line.value = t; "
            "line.dispatchEvent(new Event('input')); })(arguments[0])",
            time,
        )
        levels.append(tab.text('.level'))
        walls.append(tab.evaluate('mlmem.shown().sessions[0].panel.chain.state.walls.length'))
    assert levels == ['not read', '2', 'blank']
    assert walls == [0, 1, 0]
    assert tab.text('#events li.now').endswith('blank')
    tab.click('#events li:nth-child(2)')
    assert tab.text('.level') == '2'
    assert 'delay' in tab.text('.delay')
    tab.evaluate("document.getElementById('rate').value = 10")
    tab.click('#play')
    tab.wait_until('mlmem.shown().now >= mlmem.shown().duration', 'its end')
    assert tab.text('#play') == 'Play'


def test_element_in_the_tab_is_read_written_and_erased(tab, tmp_path):
    """Opened from its folder: nothing serves it. An element is chosen, by the address or the list;
    what was written is read at once. The register's walls leave before others come.
    """
    try_page.write_pages(tmp_path)

    def get_last_event():
        tab.evaluate('void Object.assign(mlmem.shown(), { speed: 10, paused: false })')
        tab.wait_until('!mlmem.shown().action', 'the element is idle')
        tab.evaluate('mlmem.shown().paused = true')
        return tab.text('#log li')

    tab.open(f'file://{tmp_path}/try.html?preset=case_2')
    tab.wait_until('window.mlmem', 'a page')
    assert 'level 3, first echo after' in get_last_event()
    tab.click('[data-level="4"]')  # a step under strain
    assert 'level 4, first echo after' in get_last_event()

    tab.pick('#preset', 'kick_2')
    assert 'level 3, first echo after' in get_last_event()
    tab.click('[data-do="erase"]')
    assert 'blank' in get_last_event()
    assert tab.text('.level') == 'blank'
    tab.click('[data-level="1"]')
    assert 'level 1, first echo after' in get_last_event()

    tab.pick('#preset', 'byte')
    assert 'word 12' in get_last_event()
    field = tab.driver.find_element('css selector', '.many input')
    field.clear()
    field.send_keys('0x5a')
    tab.click('.many button')
    assert 'word 90' in get_last_event()
    assert tab.text('.code') == '01011010'
    tab.click('[data-level="0"]')
    assert 'word 91' in get_last_event()


@pytest.fixture(scope='module')
def node(start_shared):
    """An eight-level element with streams at the default rates, which refuses what would wait."""
    return start_shared(GIVEN)


@pytest.fixture(scope='module')
def page(node, browser, tmp_path_factory):
    """Open the page of the running element, in a browser that has been used before."""
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path_factory.mktemp('view'))  # where its recordings go
        with serve_page() as address:
            browser.open('about:blank')
            browser.open(address)
            browser.wait_until(f'window.mlmem && {STATE}.column', 'a first picture')
            yield browser
            assert browser.list_complaints() == []
            browser.open('about:blank')  # the server ends before the browser does


def test_click_on_a_defect_writes_its_level(page, node):
    node.memory.pause().wait()  # or the wall might have arrived before it is seen
    page.click('[data-level="5"]')
    seen = set()

    def written():
        before = page.evaluate('mlmem.shown().track.end')
        node.step(20)  # until the next picture
        page.wait_until(f'mlmem.shown().track.end > {before}', 'a picture')
        seen.update(round(wall) for wall in page.evaluate(f'{STATE}.walls'))
        return page.text('.level') == '5' and page.text('.code') == '101'

    page.wait_until(written, 'level 5')
    assert len(seen - {150}) > 1, seen  # seen on its way: it jumps two levels at a time
    node.memory.pause(False).wait()
    page.wait_until(f'Math.abs({STATE}.walls[0] - 150) < 1', 'the wall on its defect')
    assert 0.0 < page.evaluate(f'{STATE}.confidence') < 1.0
    assert 'level 5' in page.text('#log li')
    assert page.evaluate('mlmem.shown().echo.level') == 5
    delays = page.wait_until('mlmem.shown().delays.left', 'the delays of the levels')
    accepted = 0.25 * (delays[6] - delays[5])  # a write's least level margin is 0.5
    assert abs(page.evaluate('mlmem.shown().echo.delay') - delays[5]) < accepted


def test_rejection_is_shown_next_to_the_button(page, node):
    both = '[data-level="6"]', '[data-do="erase"]'
    node.memory.pause().wait()  # or the write might be over before the other is heard
    page.evaluate('arguments[0].forEach((each) => document.querySelector(each).click())', both)
    said = page.wait_until(lambda: node.step(1) and page.text('#bubble'), 'a refusal')
    node.memory.pause(False).wait()
    assert 'write is running' in said
    button = page.evaluate(
        "document.querySelector('[data-do=erase]').getBoundingClientRect().toJSON()"
    )
    bubble = page.evaluate("document.getElementById('bubble').getBoundingClientRect().toJSON()")
    assert 0.0 <= bubble['top'] - button['bottom'] < 20.0
    assert bubble['left'] < (button['left'] + button['right']) / 2 < bubble['right']
    page.wait_until(lambda: page.text('.level') == '6', 'what was written all the same')


def test_fault_is_shown_in_the_health_and_removed(page):
    page.wait_until("document.getElementById('word').textContent !== 'connecting'", 'health')
    page.click('[data-fault="actuator_stuck"]')
    page.wait_until("document.getElementById('word').textContent === 'faulty'", 'a fault')
    button = "document.querySelector('[data-fault=actuator_stuck]')"
    page.wait_until(f"{button}.ariaPressed === 'true'", 'the pressed button')
    page.click('#health summary')
    assert 'actuator_stuck' in page.text('#parts')
    page.wait_until(
        lambda: 'fault set: actuator stuck' in page.text('#log'), 'the fault as an event'
    )
    page.click('#clear')
    page.wait_until(f"{button}.ariaPressed === 'false'", 'an element without faults')
    page.click('#health summary')


def test_kick_button_leaves_content_unknown_until_read(page, node):
    """The slider begins with the speed of level 4: a wall goes there."""
    node.memory.erase().wait()
    page.wait_until(lambda: page.text('.level') == 'blank', 'a blank element')
    assert page.text('#kick-spelt') == '0.079'
    page.click('[data-do="kick"]')
    page.wait_until(lambda: 'kick succeeded' in page.text('#log'), 'its end')
    page.wait_until(lambda: 'kicked by hand' in page.text('#log'), 'the reason')
    assert page.evaluate(f'{STATE}.level') == -2
    page.click('[data-do="read"]')
    page.wait_until(lambda: page.text('.level') == '4', 'a wall at level 4')


def test_reset_asks_before_it_acts(page, node):
    before = node.memory.write(5).wait().level
    page.click('[data-do="reset"]')
    assert 'is lost' in page.wait_until(lambda: page.text('#ask'), 'a question')
    page.click('#ask button')
    page.wait_until("!document.getElementById('ask').open", 'the end of it')
    assert node.memory.read().wait().level == before
    page.click('[data-do="reset"]')
    page.click('#ask .danger')
    page.wait_until(lambda: page.text('.level') == 'blank', 'a fresh element')


def test_pause_and_step_buttons_hold_time(page):
    page.click('#pause')
    page.wait_until("document.getElementById('pause').textContent === 'Run'", 'a pause')
    page.wait_until("!document.getElementById('step').disabled", 'the button')
    page.click('#step')
    page.wait_until(lambda: page.text('#bubble').startswith('tick '), 'the tick')
    page.click('#pause')
    page.wait_until("document.getElementById('pause').textContent === 'Pause'", 'time that runs')


def test_strain_slider_strains_and_releases(page):
    """The substrate follows the slider, and is released by the button."""
    drag = """(() => {
      const slider = document.getElementById('strain');
      slider.value = 0.02;
      slider.dispatchEvent(new Event('input'));
      return true;
    })()"""
    page.evaluate(drag)
    page.wait_until(f'Math.abs({STATE}.strain - 0.02) < 1e-3', 'the strain')
    assert 'tension' in page.text('.strain-now')
    page.click('#release')
    page.wait_until(f'Math.abs({STATE}.strain) < 1e-3', 'no strain')


def test_recording_is_fetched_and_opened(page):
    page.click('#record')
    page.wait_until(lambda: page.text('#record') == 'Stop', 'a recording')
    page.click('[data-do="read"]')
    page.wait_until(lambda: 'read succeeded' in page.text('#log li'), 'a read')
    page.click('#record')
    page.wait_until(lambda: 'recorded' in page.text('#log li'), 'its end')
    page.click('#log a[download]')
    (bag,) = page.wait_until(lambda: list(page.downloads.glob('*.zip')), 'the bag')
    assert any(name.endswith('metadata.yaml') for name in zipfile.ZipFile(bag).namelist())
    link = page.driver.find_element('css selector', '#log a').get_attribute('href')
    session = f'/sessions/{link.rpartition("=")[2]}'
    assert page.evaluate('(await fetch(arguments[0])).status', session) == 200


def test_page_survives_the_restart_of_its_node_as_a_register(page, node, start_shared):
    """Its words are read by waveforms: there is no threshold, and a level has no delay."""
    node.terminate()
    page.wait_until("!document.getElementById('notice').hidden", 'a word that it is gone')
    assert 'No memory node' in page.text('#notice')
    register = start_shared(GIVEN | {'element': 'robust_words'})
    page.wait_until("document.getElementById('notice').hidden", 'a word that it is back', 30.0)
    page.wait_until('mlmem.shown().about.words === 28', 'its cells')
    assert page.text('#facts').startswith('8 levels, 28 words, 102 cells')
    register.memory.write(17).wait()
    page.click('[data-do="locate"]')
    said = page.wait_until(lambda: 'locate' in (it := page.text('#log li')) and it, 'an answer')
    assert said.endswith('locate succeeded: 2 walls, at cells 44, 77')
    assert page.evaluate('mlmem.shown().about.probes.left.threshold') is None
    assert page.evaluate('mlmem.shown().about.carriers') == {'pulse': 0.495}
