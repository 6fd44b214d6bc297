# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An element whose right end names the level: nine cells between levels, and two levels near the
left end that sound alike there.
"""

import dataclasses

import pytest

from mlmem import (
    Calibrate,
    Calibration,
    Read,
    SelfTest,
    SettingsError,
    Write,
    factory_calibration,
    new_element,
    snapshot,
)
from mlmem.instrument.end import End
from mlmem.parsing import decode_value
from mlmem.presets import load_preset

from .rig import run


def device(**changes):
    element = new_element(*load_preset('bits_1'))
    element.calibration = dataclasses.replace(element.calibration, **changes)
    return element


def test_it_is_calibrated_at_both_ends():
    """Nine cells to and fro are 26 time units at the right; at the left the pulse hides them."""
    calibration = device().calibration
    left, right = (calibration.table(end).delays for end in End)
    assert len(left) == len(right) == 2
    assert right[0] - right[1] > 20.0
    assert abs(left[1] - left[0]) < 5.0


def test_it_is_written_read_and_calibrated():
    element = device()
    for command in (Write(1), Read(), Calibrate(), Read('both'), SelfTest()):
        outcome = run(element, command)
        assert outcome.success, outcome.error
        assert outcome.reading.level == 1
    assert element.calibration.pulse_corrections is None, 'there was nothing to learn'


@pytest.mark.parametrize('end', ['left', 'right', 'both', ''])
@pytest.mark.parametrize('level', [0, 1])
def test_its_level_is_named_from_the_right_whichever_delay_is_reported(level, end):
    element = device()
    run(element, Write(level))
    reading = run(element, Read(end)).reading
    assert (reading.level, reading.end, reading.walls) == (level, end or 'right', 1)
    assert reading.delay == (
        reading.left_delay if end in ('left', 'both') else reading.right_delay
    )


def test_a_calibration_of_the_right_end_alone_is_read_from_there():
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


def test_its_state_is_kept():
    element, other = device(), device()
    run(element, Write(1))
    state = snapshot.take_snapshot(element)
    assert decode_value(Calibration, state['calibration']) == element.calibration
    snapshot.restore_snapshot(other, state)
    assert snapshot.hash_state(other) == snapshot.hash_state(element)
    assert run(other, Read()).reading.level == 1


def test_a_rest_is_waited_for_before_a_pulse():
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
