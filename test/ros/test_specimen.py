# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A node with the file of a fitted element: it simulates it, or knows that it is this one."""

import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest
import rclpy
from nodes import QUICK, end_node
from robot import values
from suite import TIMEOUT_S

from mlmem import element_file, load_element
from mlmem.physics import Scatter, Specimen, draw_specimen
from mlmem.readers.calibration import PulseCorrection, PulseCorrections, hash_schedule
from mlmem_ros.session.data import load_session
from mlmem_ros.session.replay import run_replay
from mlmem_tools.identification import monitor_node

CHOSEN = load_element('bits_1')
WORDS, WORDS_SET = load_element('robust_words').design_and_settings
PLAN = PulseCorrections(
    (PulseCorrection(), PulseCorrection(peak=1.5, times=1.3)), hash_schedule(CHOSEN.settings)
)


def write_element(path, specimen, settings, **more):
    """Write the file of an element as fast as those of other tests; return its path."""
    quick = replace(settings, scale=replace(settings.scale, time=QUICK['scale.time']))
    pinned = np.zeros(specimen.design.N)
    element_file.write_element_file(
        path, element_file.Element(specimen, pinned, settings=quick, **more)
    )
    return path


@pytest.fixture
def start_monitor(monkeypatch):
    """Start the program of a monitor with a twin in a thread; return its exit status to come."""
    started = []
    with ThreadPoolExecutor() as threads:

        def start_monitor(twin):
            given = ['memory_monitor', '--ros-args', '-p', f'twin:={twin}']
            monkeypatch.setattr('sys.argv', given)
            monkeypatch.setattr(monitor_node, 'REPORT_PERIOD_S', 0.3)
            started.append(threads.submit(monitor_node.main))
            return started[-1]

        yield start_monitor
        while not all(status.done() for status in started):
            rclpy.try_shutdown()
            time.sleep(0.1)


def test_monitor_names_the_cell_that_became_weaker(start_robot, start_monitor, tmp_path):
    """With what `mlmem plan` finds: the shipped pulse does not reach level 1."""
    made = draw_specimen(CHOSEN.design, Scatter(alpha=0.01), 3)
    file = write_element(tmp_path / 'element.yaml', made, CHOSEN.settings, plan=PLAN)
    robot = start_robot({'element': str(file), 'write.method': 'strain'})
    ended = start_monitor(file)
    assert robot.write(1).success

    def status_after_a_read():
        """Return what is reported once a read has been compared."""
        robot.next_status('twin')  # the element comes to rest until the next one
        before = compared(robot.next_status('twin'))
        assert robot.trigger('read').success
        return robot.next_status('twin', lambda status: compared(status) > before)

    def compared(status):
        return int(values(status)['compared'])

    status = status_after_a_read()
    assert status.message == 'as forecast'
    alpha, deviation = (
        np.array(values(status)[name].split(), float) for name in ('alpha', 'alpha_std')
    )
    assert alpha == pytest.approx(made.alpha / CHOSEN.design.alpha, abs=1e-5)
    assert (deviation == 0.0).all()
    robot.set(faults__weak_factor=0.9, faults__weak_cell=5)
    status_after_a_read(), status_after_a_read()
    weaker = 'cell 5 has become'  # told later if what was compared last was an older read
    robot.next_status('twin', lambda status: status.message.startswith(weaker))
    rclpy.try_shutdown()
    assert ended.result(TIMEOUT_S) == 0


def test_twin_that_cannot_be_used_ends_the_start(refused, tmp_path):
    made = draw_specimen(WORDS, Scatter(alpha=0.5), 3)
    file = write_element(tmp_path / 'element.yaml', made, WORDS_SET)
    given = {'element': 'robust_words', 'design.check': 'skip'}
    word = 'word must be one whose walls rest at its levels; got '
    assert word in refused(given | {'twin': str(file)})


def test_stuck_cell_of_the_file_is_reported(start_robot, tmp_path):
    """Level 3 of bits_2 lies behind the stuck cell 31: refused by name, and in the diagnostics."""
    design, settings = load_element('bits_2').design_and_settings
    file = write_element(tmp_path / 'element.yaml', Specimen(design, stuck=(31,)), settings)
    robot = start_robot({'element': str(file), 'twin': str(file)})
    assert robot.write(1).success
    assert 'cell 31 is stuck' in robot.write(3)['error']
    assert robot.trigger('read')['level'] == 1
    status = robot.next_status('memory', lambda status: 'bad_cells' in values(status))
    assert 'level 3 cannot be reached' in values(status)['bad_cells']


@pytest.fixture(scope='module')
def register(tmp_path_factory):
    """The file of a register whose kicks are too slow but for its plan, and which the design's
    forecasts read in hardly any word.
    """
    shipped, levels = WORDS_SET.kick, WORDS.levels
    slow = replace(WORDS_SET, kick=shipped.scale_speeds(levels * [0.8], levels * [0.8]))
    steps = levels * (PulseCorrection(speed=1.25),)
    plan = PulseCorrections(steps, hash_schedule(slow), kinks=levels * (1.25,))
    made = draw_specimen(WORDS, Scatter(alpha=0.06), 3)
    return write_element(tmp_path_factory.mktemp('elements') / 'words.yaml', made, slow, plan=plan)


def test_monitor_of_a_register_ends_with_the_reason(start, register, start_monitor, capfd):
    start({'element': str(register)})
    assert start_monitor(register).result(TIMEOUT_S) == 1
    assert 'element must be one that holds one wall' in capfd.readouterr().err


def test_register_with_a_twin_writes_and_replays(start_robot, register, tmp_path):
    bag = tmp_path / 'bag'
    robot = start_robot({
        'element': str(register), 'twin': str(register), 'record.path': str(bag),
        'time.speed': 0.0,
    })  # fmt: skip
    for word in (17, 26):  # the first for the speeds of walls, the second for those of kinks
        robot.set(target_word=word)
        assert robot.trigger('write')['attempts'] == 1
    assert robot.trigger('read')['word'] == 26
    end_node(robot.memory)
    report = run_replay(load_session(bag))
    assert report.exact
    assert report.recorded_endings == ['write 17', 'write 26', 'read 26']
    assert [each.reading.level for each in report.outcomes] == [17, 26, 26]
