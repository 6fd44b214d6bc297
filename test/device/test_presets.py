# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Presets are whole, and hold what the files that shipped before them said."""

import dataclasses
import json
from pathlib import Path

import pytest

from mlmem_ros.device import PRESETS, Settings, new_element, preset
from mlmem_ros.device.settings import ActuatorSettings
from mlmem_ros.physics import CASE_I, CASE_II, DesignError

BEFORE = json.loads((Path(__file__).parents[1] / 'data' / 'presets_0_1.json').read_text())
"""What each of config/*.yaml came to in 0.1: what differs from Case II and its settings."""

SINCE = ('actuator', 'down_even', 'down_odd', 'up_even', 'up_odd', 'throw')
"""Groups of strokes and throws, which there were none of in 0.1."""

EVERY = pytest.mark.parametrize('name', PRESETS)


def different(name):
    """Return what a preset says other than Case II, by group and name."""
    design, settings = preset(name)
    said = {'design': dataclasses.asdict(design), **settings.as_dict()}
    plain = {'design': dataclasses.asdict(CASE_II), **Settings().as_dict()}
    said['erase']['method'], said['write']['last_release'] = 'kink', 0.0
    said['write']['shaped'] = False
    groups = {
        group: {key: value for key, value in values.items() if value != plain[group][key]}
        for group, values in said.items()
    }
    return {group: values for group, values in groups.items() if values}


def test_all_that_shipped_ships():
    assert list(PRESETS) == [*BEFORE]


def without(groups):
    return {group: values for group, values in groups.items() if group not in SINCE}


@EVERY
def test_a_preset_is_what_its_file_was_but_for_strokes_and_throws(name):
    assert without(different(name)) == without(BEFORE[name])


@EVERY
def test_a_strain_by_hand_is_as_slow_as_it_was(name):
    was = BEFORE[name].get('actuator', {}).get('max_rate', ActuatorSettings().max_rate)
    assert preset(name).settings.actuator.by_hand == was


@EVERY
def test_a_preset_says_nothing_of_the_robot(name):
    """Scale and disturbance are where it is mounted, the integrator is everyone's choice."""
    settings, plain = preset(name).settings, Settings()
    assert (settings.scale, settings.disturbance) == (plain.scale, plain.disturbance)
    assert settings.time.integrator == plain.time.integrator


@EVERY
def test_every_number_has_the_type_that_its_parameter_is_declared_with(name):
    for group in (preset(name).design, *preset(name).settings.groups().values()):
        for field in dataclasses.fields(group):
            assert type(getattr(group, field.name)).__name__ == field.type, field.name


def test_a_preset_is_a_design_with_its_settings():
    design, settings = preset('case_1')
    assert (design, settings) == (preset('case_1').design, preset('case_1').settings)
    assert design is CASE_I
    assert settings.probe.omega_c == 1.95


def test_an_element_is_made_of_a_preset_whole():
    """Sixteen levels, read from the right by a pulse that the defaults do not send."""
    element = new_element(preset('bits_4'))
    assert element.design == preset('bits_4').design
    assert element.settings == preset('bits_4').settings
    assert element.calibration.ends == ('right',)
    assert len(element.calibration.right.delays) == 16


def test_settings_beside_a_preset_take_the_place_of_its_own():
    _, settings = preset('bits_1')
    eager = dataclasses.replace(settings, read=dataclasses.replace(settings.read, rest=0.0))
    assert new_element(preset('bits_1'), eager).settings == eager


def test_another_name_is_refused():
    with pytest.raises(DesignError, match=r"preset must be one of case_1, .*; got 'case_9'"):
        preset('case_9')
