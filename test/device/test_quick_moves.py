# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Strokes and throws that were planned for one element."""

from dataclasses import replace

import pytest

from mlmem_ros.device import Calibrate, Settings, Write, new_element, preset
from mlmem_ros.device.calibration import Calibration
from mlmem_ros.device.moves import How, Move, cycle_of, route
from mlmem_ros.device.pulse_corrections import (
    AS_SET,
    PulseCorrections,
    QuickMoves,
    quick_schedule,
    schedule_of,
)
from mlmem_ros.outside import DecodeError, decode

DESIGN, SETTINGS = preset('case_2')
DOWN = Move(How.STROKE, 5, 4, 0.0)


def planned(peaks, settings=SETTINGS):
    return QuickMoves(peaks, quick_schedule(settings))


def element_of(name, peaks):
    """Return an element whose calibration has planned strokes and throws."""
    element = new_element(preset(name))
    settings = element.settings
    trims = PulseCorrections(
        (AS_SET,) * element.design.levels, schedule_of(settings), planned(peaks, settings)
    )
    element.calibration = replace(element.calibration, pulse_corrections=trims)
    return element


def test_a_stroke_that_is_not_used_is_avoided():
    assert [move.how for move in route(DESIGN, SETTINGS, 5, 4)] == [How.STROKE]
    adapted = planned({'down_odd': {5: 0.0}}).adapt(SETTINGS)
    assert (How.STROKE, 5) not in [(move.how, move.start) for move in route(DESIGN, adapted, 5, 4)]
    assert [move.how for move in route(DESIGN, adapted, 3, 2)] == [How.STROKE]  # as before


def test_what_the_settings_bar_stays_barred():
    adapted = planned({'throw': {3: 0.0}}).adapt(SETTINGS)
    assert adapted.throw.barred == SETTINGS.throw.barred | {3}


def test_a_stroke_has_the_peak_of_its_level():
    quick = planned({'down_odd': {5: 0.9}})
    peaks = {
        start: cycle_of(DESIGN, quick.adapt(SETTINGS, start), DOWN).motions[0].target
        / cycle_of(DESIGN, SETTINGS, DOWN).motions[0].target
        for start in (3, 5)
    }
    assert peaks == pytest.approx({3: 1.0, 5: 0.9})


def test_with_other_strokes_they_are_ignored():
    other = replace(SETTINGS, down_odd=replace(SETTINGS.down_odd, ease=99.0))
    assert planned({'down_odd': {5: 0.0}}).adapt(other) is other


def test_a_peak_stays_within_the_actuators_limit():
    assert SETTINGS.throw.peak < SETTINGS.actuator.max_strain < 2.0 * SETTINGS.throw.peak
    adapted = planned({'throw': {3: 2.0}}).adapt(SETTINGS, 3)
    assert adapted.throw.peak == SETTINGS.actuator.max_strain


def test_a_write_goes_another_way():
    """The stroke from 3 to 2 would be the quickest."""
    spent = {}
    for factor in (1.0, 0.0):
        element = element_of('bits_2', {'down_odd': {3: factor}})
        assert element.perform(Write(3)).success
        begun = element.ticks
        assert element.perform(Write(2)).reading.level == 2
        spent[factor] = element.ticks - begun
    assert spent[0.0] > 1.5 * spent[1.0]


def test_a_calibration_keeps_what_was_planned():
    element = element_of('bits_1', {})
    element.forecast = element.calibration
    quick = element.calibration.quick
    assert element.perform(Calibrate()).success
    assert element.calibration.quick == quick is not None


def test_they_survive_a_file():
    calibration = element_of('case_2', {'down_odd': {5: 0.9}, 'throw': {3: 0.0}}).calibration
    assert decode(Calibration, calibration.as_dict()) == calibration


@pytest.mark.parametrize(
    'wrong',
    [{'sideways': [[1, 0.9]]}, {'throw': [[-1, 0.0]]}, {'throw': [[1, 2.5]]}, {'throw': [[1]]},
     {'throw': [[float('inf'), 1.0]]}, {'throw': [[1, float('nan')]]}, 'throw', None],
)  # fmt: skip
def test_what_are_no_quick_moves_is_refused(wrong):
    with pytest.raises(DecodeError):
        decode(QuickMoves, {'peaks': wrong, 'schedule': ''})


def test_settings_without_strokes_have_a_schedule():
    assert quick_schedule(Settings()) != quick_schedule(SETTINGS)
