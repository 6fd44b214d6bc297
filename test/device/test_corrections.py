# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Corrections of pulses: factors by level, which a plan or a bisection found for one schedule."""

import dataclasses
import json

import pytest

from mlmem import Calibrate, Calibration, Settings, Write, new_element, preset, snapshot
from mlmem.moves.corrections import (
    PulseCorrection,
    PulseCorrections,
    apply_correction,
    hash_schedule,
)
from mlmem.parsing import decode_value
from mlmem.physics import Scatter, StateError, find_level, scattered
from mlmem.physics.equilibrium import find_pinned_wall
from mlmem.procedures import calibrating
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


def test_calibration_of_a_step_that_stops_on_its_way_fails():
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


def test_calibration_of_an_ideal_element_has_no_corrections():
    element = new_element(BITS_2)
    assert element.perform(Calibrate()).success
    assert 'pulse_corrections' not in element.calibration.as_dict()


def test_calibration_of_a_wall_one_level_too_far_fails(monkeypatch):
    element, go_to_level = new_element(BITS_2), calibrating.go_to_level

    def go_too_far(element, place, level, **options):
        yield from go_to_level(element, place, level, **options)
        if level == 1:
            element.chain.place(find_pinned_wall(element.chain.specimen, 2))

    monkeypatch.setattr(calibrating, 'go_to_level', go_too_far)
    outcome = element.perform(Calibrate())
    assert not outcome.success
    assert 'on the way to level 1' in outcome.error


def test_corrections_outlive_the_process_to_the_bit(planned, tmp_path):
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


def test_correction_scales_strains_within_the_actuators_limit():
    settings = apply_correction(BITS_2.settings, PulseCorrection(peak=7.0, times=0.5))
    assert settings.write.ramp == 0.5 * BITS_2.settings.write.ramp
    assert settings.write.ease_to == BITS_2.settings.write.ease_to
    assert settings.write.compression == -BITS_2.settings.actuator.max_strain
    assert apply_correction(BITS_2.settings, PulseCorrection()) == BITS_2.settings


@pytest.mark.parametrize(
    ('corrections', 'message'),
    [
        (7, 'pulse_corrections must be an object; got 7'),
        ({'steps': []}, 'pulse_corrections lacks schedule'),
        ({'steps': [[1.0]], 'schedule': ''}, r'steps\[0\] must be an object'),
        (
            {'steps': [[1.0, 'x', 1.0]], 'schedule': ''},
            r'pulse_corrections.steps\[0\].times must be',
        ),
        ({'steps': [[float('nan'), 1.0, 1.0]], 'schedule': ''}, 'peak must be'),
        ({'steps': [[1.0, 0.0, 1.0]], 'schedule': ''}, 'times must be'),
        (
            {'steps': [[1.0, 1.0, 1.0]], 'schedule': 7},
            'corrections.schedule must be a text; got 7',
        ),
        ({'steps': [[1.0, 1.0, 1.0]], 'schedule': ''}, '4, one for every level; got 1'),
    ],
    ids=str,
)
def test_file_with_invalid_pulse_corrections_is_rejected(planned, tmp_path, corrections, message):
    values = {**planned.calibration.as_dict(), 'pulse_corrections': corrections}
    with pytest.raises(ValueError, match=message):
        decode_value(Calibration, values).check(BITS_2.design.levels)
    path = tmp_path / 'file'
    path.write_text(json.dumps({'format': 1, 'calibrations': {'key': values}}))
    with pytest.raises(StateError, match=f'{message}|NaN is not JSON'):
        state_file.load_calibration(path, 'key', BITS_2.design.levels)
    taken = {**snapshot.take_snapshot(planned), 'calibration': values}
    with pytest.raises(StateError, match='not a snapshot of a device'):
        snapshot.restore_snapshot(scattered_element(), taken)


def test_corrections_survive_json():
    corrections = PulseCorrections(
        (PulseCorrection(), PulseCorrection(1.3, 1.6)), hash_schedule(Settings())
    )
    assert (
        decode_value(PulseCorrections, json.loads(json.dumps(corrections.as_dict())))
        == corrections
    )
