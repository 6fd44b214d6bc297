# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An element with scattered cells learns the pulses of its own steps, and keeps them."""

import dataclasses
import json

import pytest

from mlmem import (
    Calibrate,
    Calibration,
    Faults,
    SetFaults,
    Settings,
    Write,
    new_element,
    preset,
    snapshot,
)
from mlmem.moves.corrections import (
    AS_SET,
    QUICKER,
    STRONGER,
    PulseCorrection,
    PulseCorrections,
    corrected,
    menu,
    schedule_of,
)
from mlmem.parsing import decode
from mlmem.physics import StateError, level_of
from mlmem.physics.equilibrium import resting_wall
from mlmem.procedures import writing
from mlmem_ros.host import state_file

BITS_2 = preset('bits_2')


def made_by_chance(settings=BITS_2.settings, seed=12):
    """Return an element whose cells differ by 1.5 per cent, so that the wall stops on its way."""
    element = new_element(BITS_2.design, settings)
    element.apply(SetFaults(Faults(disorder_alpha=0.015, seed=seed)))
    return element


def wrong_writes(element):
    """Write all levels from the lowest, and return those that fail or are wrong."""
    return [
        level
        for level in range(element.design.levels)
        if not element.perform(Write(level)).success
        or level_of(element.design, element.chain.configuration) != level
    ]


@pytest.fixture(scope='module')
def trained():
    element = made_by_chance()
    assert element.perform(Calibrate()).success
    return element


def test_steps_that_fail_are_learnt(trained):
    assert wrong_writes(made_by_chance()) == [1]
    assert set(trained.calibration.pulse_corrections.steps) - {AS_SET}
    assert not wrong_writes(trained)


def test_nothing_is_learnt_with_a_single_pulse():
    alone = dataclasses.replace(BITS_2.settings.write, pulses=1)
    element = made_by_chance(dataclasses.replace(BITS_2.settings, write=alone))
    element.perform(Calibrate())
    assert element.calibration.pulse_corrections is None


def test_an_ideal_element_has_nothing_to_learn():
    element = new_element(BITS_2)
    assert element.perform(Calibrate()).success
    assert element.calibration.pulse_corrections is None
    assert 'pulse_corrections' not in element.calibration.as_dict()


def test_a_step_that_runs_over_skips_no_level(monkeypatch):
    element, go_to_level, late = new_element(BITS_2), writing.go_to_level, [1]

    def too_far(element, place, level, **how):
        yield from go_to_level(element, place, level, **how)
        if level in late:
            late.remove(level)
            element.chain.place(resting_wall(element.chain.specimen, level + 1))

    monkeypatch.setattr(writing, 'go_to_level', too_far)
    assert element.perform(Calibrate()).success
    assert not late
    element.calibration.check(BITS_2.design.levels)


def test_what_was_learnt_outlives_the_process_to_the_bit(trained, tmp_path):
    state_file.save_calibration(tmp_path / 'file', 'key', trained.calibration)
    kept = state_file.load_calibration(tmp_path / 'file', 'key', BITS_2.design.levels)
    assert kept == trained.calibration
    again = made_by_chance()
    snapshot.restore(again, json.loads(json.dumps(snapshot.take(trained))))
    assert again.calibration == trained.calibration
    for element in (trained, again):
        assert element.perform(Write(2)).success
    assert snapshot.digest(again) == snapshot.digest(trained)


def test_pulses_of_another_schedule_are_ignored(trained):
    learnt, settings = trained.calibration, BITS_2.settings
    assert learnt.pulses(settings) == list(learnt.pulse_corrections.steps)
    for change in ({'ramp': 150.0}, {'tension': 0.025}, {'start_strain': 0.021}):
        other = dataclasses.replace(settings.write, **change)
        changed = dataclasses.replace(settings, write=other)
        assert learnt.pulses(changed) == [AS_SET] * BITS_2.design.levels
    patient = dataclasses.replace(settings.write, attempts=9)
    assert learnt.pulses(dataclasses.replace(settings, write=patient)) == learnt.pulses(settings)


def test_a_trim_scales_times_and_strains_within_the_actuators_limit():
    settings = corrected(BITS_2.settings, PulseCorrection(peak=7.0, times=0.5))
    assert settings.write.ramp == 0.5 * BITS_2.settings.write.ramp
    assert settings.write.ease_to == BITS_2.settings.write.ease_to
    assert settings.write.compression == -BITS_2.settings.actuator.max_strain
    assert corrected(BITS_2.settings, AS_SET) == BITS_2.settings


def test_slow_cycles_are_tried_faster_and_fast_ones_stronger():
    assert menu(Settings(), 0) == menu(Settings(), 3) == (AS_SET, *QUICKER)
    assert menu(BITS_2.settings, 3) == (AS_SET, *STRONGER)


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
def test_file_with_invalid_pulse_corrections_is_rejected(trained, tmp_path, corrections, message):
    values = {**trained.calibration.as_dict(), 'pulse_corrections': corrections}
    with pytest.raises(ValueError, match=message):
        decode(Calibration, values).check(BITS_2.design.levels)
    path = tmp_path / 'file'
    path.write_text(json.dumps({'format': 1, 'calibrations': {'key': values}}))
    with pytest.raises(StateError, match=f'{message}|NaN is not JSON'):
        state_file.load_calibration(path, 'key', BITS_2.design.levels)
    taken = {**snapshot.take(trained), 'calibration': values}
    with pytest.raises(StateError, match='not a snapshot of a device'):
        snapshot.restore(made_by_chance(), taken)


def test_trims_are_values():
    trims = PulseCorrections((AS_SET, PulseCorrection(1.3, 1.6)), schedule_of(Settings()))
    assert decode(PulseCorrections, json.loads(json.dumps(trims.as_dict()))) == trims
