# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A device with the fourth-order integrator, beside one with the paper's."""

import pytest

from mlmem_ros.analysis.checks import Report, material
from mlmem_ros.analysis.checks.subject import Subject
from mlmem_ros.analysis.echo_forecast import forecast_echo
from mlmem_ros.device import Erase, Settings, SettingsError, Write, new_element
from mlmem_ros.device.calibration import calibration_key
from mlmem_ros.device.end import End
from mlmem_ros.device.settings import TimeSettings
from mlmem_ros.device.snapshot import digest, restore, take
from mlmem_ros.physics import CASE_II, PEFRL, Specimen, StateError
from mlmem_ros.physics.equilibrium import resting_wall
from mlmem_ros.verdict import Verdict

from .rig import run

FOURTH = Settings(time=TimeSettings(integrator='pefrl'))


def test_every_level_is_written_and_read_with_half_the_steps():
    element = new_element(CASE_II, FOURTH)
    assert element.chain.integrator is PEFRL
    assert element.chain.dt == 0.5
    for level in range(8):
        outcome = run(element, Write(level))
        assert (outcome.success, outcome.attempts) == (True, 1)
        assert outcome.reading.level == level
        assert outcome.reading.level_margin > 0.9
    assert run(element, Erase()).success


def test_the_delays_are_free_of_numerical_dispersion():
    """At its step the paper's method slows the carrier, and damps it by a third of eta."""
    paper, fourth = new_element(CASE_II), new_element(CASE_II, FOURTH)
    wall = resting_wall(Specimen(CASE_II), 7)
    exact = forecast_echo(CASE_II, wall, FOURTH.probe, End.LEFT, dt=0.0).delay  # by linear waves
    assert fourth.calibration.left.delays[-1] == pytest.approx(exact, abs=1.0)  # two samples
    assert abs(paper.calibration.left.delays[-1] - exact) > 2.0


def test_a_snapshot_goes_on_to_the_bit():
    element = new_element(CASE_II, FOURTH)
    run(element, Write(1))
    twin = new_element(CASE_II, FOURTH)
    restore(twin, take(element))
    for device in (element, twin):
        run(device, Write(3))
    assert digest(twin) == digest(element)


def test_a_snapshot_of_the_other_integrator_is_refused():
    element = new_element(CASE_II)
    run(element, Write(1))
    other = new_element(CASE_II, FOURTH)
    before = digest(other)
    with pytest.raises(StateError, match=r'steps per tick \(time.tick, time.integrator\)'):
        restore(other, take(element))
    assert digest(other) == before


def test_delays_of_one_integrator_do_not_apply_to_the_other():
    assert calibration_key(CASE_II, FOURTH) != calibration_key(CASE_II, Settings())


def test_the_design_check_judges_the_damping_by_the_method():
    third, fourth = (
        Report(tuple(material.check(Subject(CASE_II, each))))['step']
        for each in (Settings(), FOURTH)
    )
    assert fourth.verdict is Verdict.PASS
    own = [step.values['own damping'] for step in (third, fourth)]
    assert own[1] < 1e-2 * own[0] < 0.65 * CASE_II.eta


def test_an_unknown_integrator_is_refused():
    with pytest.raises(SettingsError, match='integrator must be one of noh_bathe, pefrl; got'):
        TimeSettings(integrator='euler')
