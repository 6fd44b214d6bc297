# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Every setting is checked; presets are whole, and keep their content whatever a hand does."""

import dataclasses
import math

import pytest
from sampled import sampled

from mlmem import (
    PRESETS,
    Calibration,
    MemoryElement,
    SetStrain,
    Settings,
    SettingsError,
    preset,
)
from mlmem.physics import Specimen, find_level
from mlmem.physics.equilibrium import find_pinned_wall
from mlmem.readers.calibration import DelayTable
from mlmem.schema import find_descriptions
from mlmem.settings import ActuatorSettings

EVERY = [
    (group.name, field.name)
    for group in dataclasses.fields(Settings)
    for field, _ in find_descriptions(getattr(Settings(), group.name))
]


def changed(group, **values):
    return dataclasses.replace(getattr(Settings(), group), **values)


def test_every_setting_is_described():
    for group in dataclasses.fields(Settings):
        fields = dataclasses.fields(getattr(Settings(), group.name))
        assert [name for of, name in EVERY if of == group.name] == [field.name for field in fields]


def test_every_setting_is_checked():
    for group, name in EVERY:
        value = getattr(getattr(Settings(), group), name)
        wrong = ['nowhere', 7, None] if isinstance(value, str) else [math.nan, math.inf, 'x', None]
        for bad in wrong:
            with pytest.raises(SettingsError, match=f'{name} must be .*; got'):
                changed(group, **{name: bad})


def test_bounds_of_every_number_are_legal():
    for group, name in EVERY:
        ((_, description),) = [
            found
            for found in find_descriptions(getattr(Settings(), group))
            if found[0].name == name
        ]
        if description.choices or description.low is None:
            continue
        for bound, beyond in ((description.low, -math.inf), (description.high, math.inf)):
            assert getattr(changed(group, **{name: bound}), name) == bound
            outside = bound + (1 if beyond > 0 else -1) if isinstance(bound, int) else None
            outside = math.nextafter(bound, beyond) if outside is None else outside
            with pytest.raises(SettingsError, match=name):
                changed(group, **{name: outside})


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


@pytest.mark.parametrize('name', sampled(PRESETS, lambda name: name in SOME))
def test_strain_by_hand_keeps_content(name):
    """0.005 of either sign is well below what frees a wall; at twice the rate some are lost."""
    design, settings = preset(name)
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
    settings = preset('kick_2').settings
    with pytest.raises(SettingsError, match=r'^read.kicked_gain times probe.A must be .*; got 1'):
        dataclasses.replace(settings, probe=dataclasses.replace(settings.probe, A=0.2))
