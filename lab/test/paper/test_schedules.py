# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Schedules with nine cells a level and their margins: those of docs/presets.md."""

import pytest
from bare_writes import writes

from mlmem import Settings
from mlmem.instrument.motion import Cycle
from mlmem.presets import load_preset
from mlmem_tools.checks.bare import scale_peaks
from mlmem_tools.checks.concern import Subject
from mlmem_tools.checks.schedule import compute_cycle_time

LEVEL_TIMES = {'bits_1': 500.0, 'bits_2': 620.0, 'bits_4': 800.0}
"""Time units of a level, as documented."""


@pytest.mark.parametrize('name', LEVEL_TIMES)
def test_level_time_is_documented_and_the_actuator_follows(name):
    design, settings = load_preset(name)
    assert Cycle.plan_cycle(settings.write, 1.0).duration == LEVEL_TIMES[name]
    step = compute_cycle_time(Subject(design, settings), settings.write)
    assert step == pytest.approx(LEVEL_TIMES[name])  # what the actuator's rate makes of it
    for part in ('ramp', 'hold', 'ease', 'release', 'settle'):
        assert getattr(settings.write, part) % settings.time.tick == 0.0


@pytest.mark.parametrize('name', LEVEL_TIMES)
def test_designed_element_keeps_the_default_tick(name):
    """A shorter one would wake the node more often."""
    assert load_preset(name)[1].time == Settings().time


def test_probe_of_a_damped_element_makes_up_for_its_damping():
    design, settings = load_preset('kick_2')
    assert design.eta == 0.01
    assert settings.probe_right.gain_decay == 0.5 * design.eta


@pytest.mark.parametrize(
    'factors',
    [(0.8, 1.2), (1.2, 0.8), *(pytest.param((x, x), marks=pytest.mark.slow) for x in (0.8, 1.2))],
)
@pytest.mark.parametrize('name', LEVEL_TIMES)
def test_write_with_both_peaks_off_succeeds(name, factors):
    design, settings = load_preset(name)
    few = None if design.levels <= 8 else [0, 1]
    assert all(writes(design, scale_peaks(settings.write, *factors), few))
