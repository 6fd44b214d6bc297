# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The fast schedules and their margins: those of docs/presets.md, with both peaks off."""

import dataclasses

import pytest
from bare_writes import writes
from sampled import sampled

from mlmem_lab.studies.proof import Proof, Tally
from mlmem_ros.device import Settings
from mlmem_ros.device.motion import Cycle
from mlmem_ros.parameter_file import load
from mlmem_tools.checks import Verdict, check
from mlmem_tools.checks.bare import scaled
from mlmem_tools.checks.concern import Subject
from mlmem_tools.checks.schedule import cycle_time

PER_LEVEL = {
    'fast': 1800.0,
    'bits_1': 500.0,
    'bits_2': 620.0,
    'damped_bits_3': 450.0,
    'bits_4': 800.0,
    'damped_bits_4': 550.0,
    'bits_5': 1000.0,
    'bits_6': 1500.0,
    'bits_8': 2760.0,
}
"""Time units of a level, as documented."""

SHIPPED = tuple(PER_LEVEL)


@pytest.mark.parametrize('name', SHIPPED)
def test_a_level_takes_what_is_documented_and_the_actuator_follows(name):
    design, settings = load(name)
    assert Cycle.planned(settings.write, 1.0).duration == PER_LEVEL[name]
    step = cycle_time(Subject(design, settings), settings.write)
    assert step == pytest.approx(PER_LEVEL[name])  # what the actuator's rate makes of it
    for part in ('ramp', 'hold', 'ease', 'release', 'settle'):
        assert getattr(settings.write, part) % settings.time.tick == 0.0


@pytest.mark.parametrize('name', sampled(['fast', 'damped_bits_3'], lambda name: name != 'fast'))
def test_the_design_check_warns_and_does_not_refuse(name):
    assert check(*load(name)).verdict is Verdict.WARN  # the ramps are short beside the damping


@pytest.mark.parametrize('name', [name for name in SHIPPED if name.startswith('bits_')])
def test_an_element_by_the_designer_keeps_the_default_tick(name):
    """A shorter one would wake the node more often."""
    assert load(name)[1].time == Settings().time


@pytest.mark.parametrize('name', ['damped_bits_3', 'damped_bits_4'])
def test_the_probe_of_a_damped_element_makes_up_for_its_damping(name):
    design, settings = load(name)
    assert design.eta == 0.01
    assert settings.probe_right.gain_decay == 0.5 * design.eta


@pytest.mark.parametrize(
    'factors',
    [(0.8, 1.2), (1.2, 0.8), *(pytest.param((x, x), marks=pytest.mark.slow) for x in (0.8, 1.2))],
)
@pytest.mark.parametrize('name', [name for name in SHIPPED if load(name)[0].levels <= 16])
def test_both_peaks_may_be_off(name, factors):
    design, settings = load(name)
    few = None if design.levels <= 8 else [0, 1]
    assert all(writes(design, scaled(settings.write, *factors), few))


@pytest.mark.parametrize('factors', [(0.7, 0.7), (0.7, 1.3), (1.3, 0.7), (1.3, 1.3)])
def test_eight_levels_at_450_are_farther_from_failure_than_the_plain_schedule(factors):
    """Ten times faster than the paper's element, whose plain tension fails when 30 % weaker."""
    quick, plain = (load(name) for name in ('damped_bits_3', 'bits_3'))
    assert all(writes(quick.design, scaled(quick.settings.write, *factors), [1]))
    done = all(writes(plain.design, scaled(plain.settings.write, *factors), [1]))
    assert done == (factors[1] > 1.0)


def test_damping_is_what_makes_450_possible():
    """With the paper's, the ringing of a step upsets the next."""
    design, settings = load('damped_bits_3')
    ringing = dataclasses.replace(design, eta=1 / 250)
    assert all(writes(design, settings.write))
    assert not all(writes(ringing, settings.write))


@pytest.mark.parametrize('gains', [(0.4, 1.0), (1.0, 0.5)])
def test_a_peak_that_is_far_too_weak_frees_no_wall(gains):
    design, settings = load('fast')
    done = list(writes(design, scaled(settings.write, *gains), [0, 1]))
    assert len(done) == 13
    assert done.count(False) > 6


def test_the_tension_of_the_papers_element_works_by_its_haste():
    """Slowly raised it frees no wall: of the writes from level 1 none comes out right."""
    design, settings = load('fast')
    slow = dataclasses.replace(settings.write, ramp=1200.0)
    assert list(writes(design, slow, [1])) == [False] * 6


@pytest.mark.slow
@pytest.mark.parametrize('name', ['fast', 'damped_bits_3', 'damped_bits_4'])
def test_a_fast_element_is_proven(name):
    study = Proof(*load(name)).campaign()
    tally = Tally.of(study.evaluate_point(point) for point in range(len(study.points)))
    assert tally.errors == ()


def test_eight_levels_at_450_are_written_and_read_back():
    study = Proof(*load('damped_bits_3'), sample=2).campaign()
    assert study.points[0]['kind'] == 'upward'
    assert study.evaluate_point(0)['error'] == ''
