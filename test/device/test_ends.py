# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Reads from both ends: no error of one end changes a level, and walls other than one are none."""

import dataclasses

import hypothesis
import hypothesis.strategies as st
import pytest

from mlmem import (
    ELEMENT_NAMES,
    UNDECODABLE,
    Calibration,
    Faults,
    MemoryElement,
    Read,
    factory_calibration,
    load_element,
)
from mlmem.instrument.end import End
from mlmem.physics import CASE_II
from mlmem.readers.calibration import DelayTable
from mlmem.readers.decoding import find_exchanged_levels

from . import rig
from .test_bad_cells import STUCK_CELL, element_with
from .test_procedures import ROBUST_NAMES
from .test_robust_element import make_scattered

NAMES = ('left', 'right', 'both')


@pytest.mark.parametrize(
    'name', [name for name in ELEMENT_NAMES if load_element(name).settings.read.method == 'delay']
)
def test_no_calibration_that_ships_lets_one_end_change_level(name):
    design, settings = load_element(name).design_and_settings
    calibration = factory_calibration(design, settings)
    for names in NAMES:
        read_from = rig.change(settings, read={'end': names})
        assert find_exchanged_levels(design, read_from, calibration) == []


@rig.unhurried
@hypothesis.given(
    st.lists(st.integers(1, 60), min_size=2, max_size=6),
    st.lists(st.integers(1, 60), min_size=2, max_size=6),
    st.floats(0.0, 0.9),
    st.sampled_from(NAMES),
)
def test_no_table_at_all_lets_one_end_change_level(left, right, margin, names):
    """Levels may be as near each other, and as unevenly spaced, as they like."""
    n = min(len(left), len(right))
    one = DelayTable(tuple(130.0 + float(sum(left[:k])) for k in range(n)))
    other = DelayTable(tuple(900.0 - float(sum(right[:k])) for k in range(n)))
    _, settings = load_element('case_2').design_and_settings
    read_from = rig.change(settings, read={'end': names, 'min_margin': margin})
    design = dataclasses.replace(CASE_II, N=25 * (n + 1))
    assert find_exchanged_levels(design, read_from, Calibration(one, other)) == []


def test_rest_is_waited_for_before_pulse():
    """Of two equal devices one waits 400 time units, 20 ticks, longer."""
    design, settings = load_element('bits_1').design_and_settings
    fired = []
    for rest in (0.0, 400.0):
        changed = rig.change(settings, read={'rest': rest})
        element = MemoryElement(design, changed, factory_calibration(design, settings))
        element.apply(Read())
        while not element.transducer.is_driving:
            element.advance()
        fired.append(element.ticks)
    assert fired[1] - fired[0] == 20


def waveform_reader(name):
    """Return an element that is read by waveforms, and contents of it."""
    if name == 'byte':
        return MemoryElement(load_element('byte')), (0x0, 0x18, 0x5A, 0xA7, 0xFF)
    if name == 'stuck cell':
        element = element_with('case_2', str(STUCK_CELL), Faults(stuck_cell=STUCK_CELL))
        return element, element.reader.forecasts.usable
    element = make_scattered(name, 1)
    return element, range(element.design.levels)


@pytest.mark.parametrize('name', [*ROBUST_NAMES, 'byte', 'stuck cell'])
def test_late_end_changes_no_content_read_by_waveforms(name):
    """One end alone may tell a level, and late it may look like another one. Sound records are
    decoded as what they are, which `record_shots` asserts.
    """
    element, contents = waveform_reader(name)
    for content, (shot, *rest) in zip(contents, rig.record_shots(element, contents), strict=True):
        for late in (1.0, 2.0, 4.5, 8.5, 16.5, 24.5, 33.5, 56.0):
            for end in End:
                reading = element.reader.forecasts.decode(rig.delay_end(shot, end, late), *rest)
                assert reading.level in (content, UNDECODABLE), (end, late)
