# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Corrections of pulses: factors by level, which a plan or a bisection found for one schedule."""

import dataclasses
import json

import pytest

from mlmem import Calibrate, Calibration, Write, new_element, preset, snapshot
from mlmem.moves.corrections import (
    PulseCorrection,
    PulseCorrections,
    apply_correction,
    hash_schedule,
)
from mlmem.parsing import decode_value
from mlmem.physics import Scatter, StateError, find_level, scattered
from mlmem_ros.host import state_file

BITS_2 = preset('bits_2')
STRONGER = PulseCorrection(1.3, 1.6)
PLAN = PulseCorrections((PulseCorrection(), *[STRONGER] * 3), hash_schedule(BITS_2.settings))
"""Pulses that reach every level of the scattered element."""


def scattered_element(plan=None):
    """Return an element whose cells differ by 1.5 per cent, so that the wall stops on its way."""
    element = new_element(BITS_2)
    element.chain.set_specimen(scattered(BITS_2.design, Scatter(alpha=0.015), 12))
    element.calibration = dataclasses.replace(element.calibration, pulse_corrections=plan)
    return element


def failed_writes(element):
    """Write all levels from the lowest, and return those that fail or are wrong."""
    return [
        level
        for level in range(element.design.levels)
        if not element.perform(Write(level)).success
        or find_level(element.design, element.chain.configuration) != level
    ]


@pytest.fixture(scope='module')
def planned():
    """The scattered element, calibrated with its plan."""
    element = scattered_element(PLAN)
    assert element.perform(Calibrate()).success
    return element


def test_calibration_of_step_that_stops_on_its_way_fails():
    """The old calibration is kept."""
    element = scattered_element()
    known = element.calibration
    assert element.perform(Write(0)).success
    outcome = element.perform(Calibrate())
    assert not outcome.success
    assert outcome.error.startswith('the calibration was not taken: ')
    assert 'level 1' in outcome.error
    assert element.calibration == known
    assert outcome.reading.level == 0


def test_writes_with_planned_corrections_succeed(planned):
    assert failed_writes(scattered_element()) == [1]
    assert planned.calibration.pulse_corrections == PLAN
    assert not failed_writes(planned)


def test_corrections_outlive_process_to_bit(planned, tmp_path):
    state_file.save_calibration(tmp_path / 'file', 'key', planned.calibration)
    kept = state_file.load_calibration(tmp_path / 'file', 'key', BITS_2.design.levels)
    assert kept == planned.calibration
    again = scattered_element()
    snapshot.restore_snapshot(again, json.loads(json.dumps(snapshot.take_snapshot(planned))))
    assert again.calibration == planned.calibration


def test_corrections_of_another_schedule_are_ignored():
    known = dataclasses.replace(new_element(BITS_2).calibration, pulse_corrections=PLAN)
    settings = BITS_2.settings
    assert known.corrections_by_level(settings) == list(PLAN.steps)
    for change in ({'ramp': 150.0}, {'tension': 0.025}, {'start_strain': 0.021}):
        other = dataclasses.replace(settings.write, **change)
        changed = dataclasses.replace(settings, write=other)
        assert known.corrections_by_level(changed) == [PulseCorrection()] * BITS_2.design.levels
    more = dataclasses.replace(settings, write=dataclasses.replace(settings.write, attempts=9))
    assert known.corrections_by_level(more) == list(PLAN.steps)


def test_correction_scales_strains_within_actuators_limit():
    settings = apply_correction(BITS_2.settings, PulseCorrection(peak=7.0, times=0.5))
    assert settings.write.ramp == 0.5 * BITS_2.settings.write.ramp
    assert settings.write.ease_to == BITS_2.settings.write.ease_to
    assert settings.write.compression == -BITS_2.settings.actuator.max_strain
    assert apply_correction(BITS_2.settings, PulseCorrection()) == BITS_2.settings


@pytest.mark.parametrize(
    'corrections',
    [
        7,
        {'steps': []},
        {'steps': [[1.0]], 'schedule': ''},
        {'steps': [[1.0, 'x', 1.0]], 'schedule': ''},
        {'steps': [[float('nan'), 1.0, 1.0]], 'schedule': ''},
        {'steps': [[1.0, 0.0, 1.0]], 'schedule': ''},
        {'steps': [[1.0, 1.0, 1.0]], 'schedule': 7},
        {'steps': [[1.0, 1.0, 1.0]], 'schedule': ''},  # four levels need four
    ],
    ids=str,
)
def test_file_with_invalid_pulse_corrections_is_rejected(planned, tmp_path, corrections):
    values = {**planned.calibration.as_dict(), 'pulse_corrections': corrections}
    with pytest.raises(ValueError, match=r'must be|lacks'):
        decode_value(Calibration, values).check(BITS_2.design.levels)
    path = tmp_path / 'file'
    path.write_text(json.dumps({'format': 1, 'calibrations': {'key': values}}))
    with pytest.raises(StateError):
        state_file.load_calibration(path, 'key', BITS_2.design.levels)
    taken = {**snapshot.take_snapshot(planned), 'calibration': values}
    with pytest.raises(StateError):
        snapshot.restore_snapshot(scattered_element(), taken)
