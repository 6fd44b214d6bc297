# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An element that is read only from the right, as a long one must be."""

import dataclasses

import pytest

from mlmem_ros.device import (
    Calibrate,
    Calibration,
    Read,
    SelfTest,
    SettingsError,
    Write,
    new_element,
    snapshot,
)
from mlmem_ros.device.end import End
from mlmem_ros.parameter_file import load

from .rig import run


def device():
    return new_element(*load('bits_1'))


def test_it_is_calibrated_at_the_right_alone():
    calibration = device().calibration
    assert calibration.left is None
    assert len(calibration.right.delays) == 2
    with pytest.raises(SettingsError, match='the left end is not read from'):
        calibration.table(End.LEFT)


def test_it_is_written_read_and_calibrated():
    element = device()
    for command in (Write(1), Read(), Calibrate(), Read('both'), SelfTest()):
        outcome = run(element, command)
        assert outcome.success, outcome.error
        assert outcome.reading.level == 1
    assert element.calibration.left is None


def test_a_read_from_the_left_is_not_decoded():
    element = device()
    run(element, Write(0))
    outcome = run(element, Read('left'))
    assert not outcome.success
    assert 'the left end is not read from (read.end is right)' in outcome.error


def test_its_state_is_kept():
    element, other = device(), device()
    run(element, Write(1))
    state = snapshot.take(element)
    assert Calibration.from_dict(state['calibration']) == element.calibration
    snapshot.restore(other, state)
    assert snapshot.digest(other) == snapshot.digest(element)
    assert run(other, Read()).reading.level == 1


def test_a_rest_is_waited_for_before_a_pulse():
    """Of two equal devices one waits 400 time units, 20 ticks, longer."""
    design, settings = load('bits_1')
    longer = dataclasses.replace(settings.read, rest=settings.read.rest + 400.0)
    ticks = []
    for read in (settings.read, longer):
        element = new_element(design, dataclasses.replace(settings, read=read))
        run(element, Write(0))
        outcome = run(element, Read())
        ticks.append(outcome.end_tick - outcome.start_tick)
    assert ticks[1] - ticks[0] == 20
