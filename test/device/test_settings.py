# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Every setting is checked; presets are whole, and keep their content whatever a hand does."""

import dataclasses
import math

import pytest
from sampled import sampled

from mlmem import (
    ELEMENT_NAMES,
    Calibration,
    MemoryElement,
    SetStrain,
    Settings,
    SettingsError,
    load_element,
)
from mlmem.physics import Specimen, find_level
from mlmem.physics.equilibrium import find_pinned_wall
from mlmem.readers.calibration import DelayTable
from mlmem.schema import find_descriptions
from mlmem.settings import ActuatorSettings


def changed(group, **values):
    return dataclasses.replace(getattr(Settings(), group), **values)


PEAKS = ('compression', 'tension', 'start_strain')


@pytest.mark.parametrize('peak', PEAKS)
@pytest.mark.parametrize('group', ['write', 'erase'])
def test_no_peak_may_exceed_actuators_limit(group, peak):
    """All other peaks are a tenth as great."""
    given = {name: getattr(Settings(), name) for name in ('write', 'erase')}
    for name, each in given.items():
        peaks = {peak: 0.1 * getattr(each, peak) for peak in PEAKS}
        given[name] = dataclasses.replace(each, **peaks)
    value = getattr(getattr(Settings(), group), peak)
    given[group] = dataclasses.replace(given[group], **{peak: value})
    Settings(actuator=ActuatorSettings(max_strain=abs(value)), **given)
    with pytest.raises(SettingsError) as rejected:
        Settings(actuator=ActuatorSettings(max_strain=0.999 * abs(value)), **given)
    assert rejected.value.field == f'{group}.{peak}'


SOME = 'case_2', 'bits_2'
"""Presets with which a wall is strained by default; slow tests have them all."""


@pytest.mark.parametrize('name', sampled(ELEMENT_NAMES, lambda name: name in SOME))
def test_strain_by_hand_keeps_content(name):
    """0.005 of either sign is well below what frees a wall; at twice the rate some are lost."""
    design, settings = load_element(name).design_and_settings
    table = DelayTable(tuple(range(design.levels)), None)  # nothing is read here
    element = MemoryElement(design, settings, Calibration(table, table))
    for level in {0, design.levels // 2, design.levels - 1}:
        wall = find_pinned_wall(Specimen(design), level)
        for strain in (0.005, -0.005):
            element.chain.place(wall)
            for each in (strain, 0.0):
                element.apply(SetStrain(each))
                while element.actuator.is_moving:
                    element.advance()
            for _ in range(math.ceil(1000.0 / element.tick)):
                element.advance()
            assert find_level(design, element.chain.configuration) == level


def test_settings_with_too_strong_kicked_pulse_are_rejected():
    """5 times 0.2 is beyond the greatest amplitude of a pulse, 0.5."""
    settings = load_element('kick_2').settings
    with pytest.raises(SettingsError, match=r'^read.kicked_gain times probe.A must be .*; got 1'):
        dataclasses.replace(settings, probe=dataclasses.replace(settings.probe, A=0.2))


@pytest.mark.parametrize('group', [field.name for field in dataclasses.fields(Settings)])
def test_every_setting_is_described_and_bounded(group):
    """Both bounds of a number are legal; whatever is beyond, or of another type, is rejected."""
    described = dict(find_descriptions(getattr(Settings(), group)))
    assert list(described) == list(dataclasses.fields(getattr(Settings(), group)))
    for field, row in described.items():
        value = getattr(getattr(Settings(), group), field.name)
        text = isinstance(value, str)
        wrong = ['nowhere', 7, None] if text else [math.nan, math.inf, 'x', None]
        bounded = not (row.choices or row.low is None)
        for bound, beyond in ((row.low, -math.inf), (row.high, math.inf)) if bounded else ():
            assert getattr(changed(group, **{field.name: bound}), field.name) == bound
            step = 1 if beyond > 0 else -1
            whole = isinstance(bound, int)
            wrong.append(bound + step if whole else math.nextafter(bound, beyond))
        for bad in wrong:
            with pytest.raises(SettingsError, match=f'{field.name} must be .*; got'):
                changed(group, **{field.name: bad})
