# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An element with one wire: one transducer at its left end writes, reads and erases it."""

import json
from dataclasses import replace

import numpy as np
import pytest

from mlmem import (
    BLANK,
    UNDECODABLE,
    Abort,
    Calibrate,
    Erase,
    Faults,
    MemoryElement,
    Read,
    Refused,
    SetFaults,
    SettingsError,
    Write,
    load_element,
)
from mlmem.instrument.drivers import Simulation
from mlmem.instrument.end import End
from mlmem.physics import Scatter, find_walls, scattered
from mlmem.procedure_table import Survey
from mlmem.rejections import ErrorCode
from mlmem.snapshot import restore_snapshot, take_snapshot

SHIPPED = load_element('robust_3_one_end')

SCATTER = Scatter(alpha=0.03, k_r=0.03, mass=0.03)


def make_scattered(seed):
    """Return an element whose parts scatter by 3 %."""
    driver = Simulation.of(scattered(SHIPPED.design, SCATTER, seed), SHIPPED.settings.time)
    return MemoryElement(SHIPPED.design, SHIPPED.settings, driver=driver)


@pytest.fixture(scope='module')
def calibrated():
    """Return the state of a scattered element after its calibration; nothing changes it."""
    element = make_scattered(1)
    assert element.perform(Calibrate()).success
    return json.dumps(take_snapshot(element))


@pytest.fixture
def element(calibrated):
    """Return a calibrated element, restored from that state."""
    element = make_scattered(1)
    restore_snapshot(element, json.loads(calibrated))
    return element


def test_left_end_writes_reads_and_erases_every_level(element):
    for level in np.random.default_rng(2).permutation(element.design.levels).tolist():
        assert element.perform(Write(level)).success
        (wall,) = find_walls(element.design, element.chain.configuration)
        assert wall.position == pytest.approx(element.design.defect_site(level), abs=1.5)
        readings = [element.perform(Read()).reading for _ in range(10)]
        assert {each.content for each in readings} == {level}
        # records are of the same wall: a healthy read hardly differs from its record
        assert min(each.level_margin for each in readings) > 0.9
    assert element.perform(Erase()).success
    assert find_walls(element.design, element.chain.configuration) == []
    assert element.perform(Read()).reading.content == BLANK


def test_nothing_is_heard_from_the_right_end(element):
    """Whatever the right end does, it counts as inactive and at rest."""
    element.perform(Write(6))
    assert np.ptp(element.transducer.recent[End.RIGHT.row]) == 0.0
    assert element.phase(End.RIGHT) == 0


@pytest.mark.parametrize('site', [9, 20, 33, 46, 61])
@pytest.mark.parametrize('weak', [False, True], ids=['stuck', 'weak'])
def test_cell_that_breaks_later_makes_no_read_wrong(element, site, weak):
    for level in (1, 3, 6):
        element.place_content(level)
        element.apply(SetFaults(
            Faults(weak_cell=site, weak_factor=0.3) if weak else Faults(stuck_cell=site)
        ))  # fmt: skip
        for _ in range(100):  # a wall that it moves comes to rest
            element.advance()
        walls = find_walls(element.design, element.chain.configuration)
        reading = element.perform(Read()).reading
        if reading.content != UNDECODABLE:
            (wall,) = walls
            assert wall.position == pytest.approx(
                element.design.defect_site(reading.content), abs=1.5
            )
        element.apply(SetFaults(Faults()))


@pytest.mark.parametrize('command', [Read(), Write(2), Erase()])
def test_uncalibrated_element_asks_for_a_calibration_at_once(command):
    element = make_scattered(1)
    with pytest.raises(Refused, match='calibrate the element first') as refused:
        element.apply(command)
    assert (refused.value.code, refused.value.field) == (ErrorCode.UNSUPPORTED, 'read.method')
    assert element.ticks == 0


def test_element_that_has_changed_asks_for_a_calibration(element):
    """Springs on the sites that are a fifth stiffer or softer fit no record."""
    element.perform(Write(2))
    element.apply(SetFaults(Faults(disorder_alpha=0.2)))
    for _ in range(100):
        element.advance()
    assert not element.perform(Read()).success


def test_aborted_calibration_keeps_the_old_records(element):
    known = element.calibration.records
    element.apply(Calibrate())
    for _ in range(2000):
        element.advance()
    element.perform(Abort())
    assert element.calibration.records == known
    assert element.perform(Write(0)).success


def change_method(shipped):
    """Return an element of a file with one transducer in place of two."""
    read = replace(shipped.settings.read, method='records', end='left')
    return MemoryElement(shipped.design, replace(shipped.settings, read=read))


@pytest.mark.parametrize(
    ('name', 'code'),
    [('robust_2', 'unsupported'), ('robust_2_friction', 'unsupported'), ('case_2', 'conflict')],
)
def test_other_elements_refuse_one_transducer(name, code):
    shipped = load_element(name)
    with pytest.raises(SettingsError) as refused:
        change_method(shipped)
    assert refused.value.code.value == code


def test_one_transducer_surveys_nothing(element):
    with pytest.raises(Refused):
        element.apply(Survey())
