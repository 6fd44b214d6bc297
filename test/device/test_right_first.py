# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An element whose right end names the level: nine cells between levels, and two levels near the
left end that sound alike there.
"""

import dataclasses

import pytest

from mlmem import (
    Calibrate,
    Read,
    SelfTest,
    SettingsError,
    Write,
    factory_calibration,
    new_element,
)
from mlmem.instrument.end import End
from mlmem.presets import load_preset

from .rig import run


def device(**changes):
    element = new_element(*load_preset('bits_1'))
    element.calibration = dataclasses.replace(element.calibration, **changes)
    return element


def test_bits_1_is_written_read_and_calibrated():
    """Nine cells to and fro are 26 time units at the right; at the left the pulse hides them."""
    element = device()
    left, right = (element.calibration.table(end).delays for end in End)
    assert right[0] - right[1] > 20.0
    assert abs(left[1] - left[0]) < 5.0
    for command in (Write(1), Read(), Calibrate(), Read('both'), SelfTest()):
        outcome = run(element, command)
        assert outcome.success, outcome.error
        assert outcome.reading.level == 1
    assert element.calibration.pulse_corrections is None, 'there was nothing to learn'


@pytest.mark.parametrize('end', ['left', 'right', 'both', ''])
@pytest.mark.parametrize('level', [0, 1])
def test_level_is_named_from_right_for_any_reported_end(level, end):
    element = device()
    run(element, Write(level))
    reading = run(element, Read(end)).reading
    assert (reading.level, reading.end, reading.walls) == (level, end or 'right', 1)
    assert reading.delay == (
        reading.left_delay if end in ('left', 'both') else reading.right_delay
    )


def test_calibration_of_right_end_alone_is_read_from_there():
    """As sessions before version 1.1 have it: no other end confirms the level."""
    element = device(left=None)
    for command in (Write(1), Calibrate(), Read('left'), Read()):
        outcome = run(element, command)
        assert outcome.success, outcome.error
        assert (outcome.reading.level, outcome.reading.end) == (1, 'right')
        assert outcome.reading.left_delay is None
    assert element.calibration.left is None
    with pytest.raises(SettingsError, match='the left end is not read from'):
        element.calibration.table(End.LEFT)


def test_rest_is_waited_for_before_pulse():
    """Of two equal devices one waits 400 time units, 20 ticks, longer."""
    design, settings = load_preset('bits_1')
    fired = []
    for rest in (0.0, 400.0):
        read = dataclasses.replace(settings.read, rest=rest)
        changed = dataclasses.replace(settings, read=read)
        element = new_element(design, changed, factory_calibration(design, settings))
        element.apply(Read())
        while not element.transducer.is_driving:
            element.advance()
        fired.append(element.ticks)
    assert fired[1] - fired[0] == 20
