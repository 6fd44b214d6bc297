# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Presets are whole, and keep their content whatever a hand does."""

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
from mlmem.physics import DesignError, Specimen, find_level
from mlmem.physics.equilibrium import find_pinned_wall
from mlmem.readers.calibration import DelayTable
from mlmem.schema import find_descriptions

EVERY = pytest.mark.parametrize('name', PRESETS)
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


@EVERY
def test_preset_says_nothing_of_robot(name):
    """Scale and disturbance are where it is mounted, the integrator is everyone's choice."""
    settings, plain = preset(name).settings, Settings()
    assert (settings.scale, settings.disturbance) == (plain.scale, plain.disturbance)
    assert settings.time.integrator == plain.time.integrator


@EVERY
def test_every_number_has_type_of_its_parameter(name):
    for group in (preset(name).design, *preset(name).settings.groups().values()):
        for field, _ in find_descriptions(group):
            assert type(getattr(group, field.name)).__name__ == field.type, field.name


def test_another_name_is_rejected():
    with pytest.raises(DesignError, match=r"preset must be one of case_1, .*; got 'case_9'"):
        preset('case_9')


def test_settings_with_too_strong_kicked_pulse_are_rejected():
    """5 times 0.2 is beyond the greatest amplitude of a pulse, 0.5."""
    settings = preset('kick_2').settings
    with pytest.raises(SettingsError, match=r'^read.kicked_gain times probe.A must be .*; got 1'):
        dataclasses.replace(settings, probe=dataclasses.replace(settings.probe, A=0.2))
