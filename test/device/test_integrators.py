# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A device with the paper's integrator, beside one with the fourth-order one, the default."""

import pytest

from mlmem import Erase, Read, Settings, Write, new_element
from mlmem.instrument.end import End
from mlmem.physics import CASE_II, INTEGRATORS, Specimen, StateError
from mlmem.physics.equilibrium import find_pinned_wall
from mlmem.readers.calibration import calibration_key
from mlmem.settings import TimeSettings
from mlmem.snapshot import hash_state, restore_snapshot, take_snapshot
from mlmem_ros.host.design_check import Verdict
from mlmem_tools.checks import Report, material
from mlmem_tools.checks.concern import Subject
from mlmem_tools.checks.echoes import forecast_echo

from . import rig
from .rig import DESIGN, run

FOURTH, PAPER = Settings(), Settings(time=TimeSettings(integrator='noh_bathe'))


def test_every_level_is_written_and_read():
    """Its margin is the lesser of both ends, and a wall just written may be a cell off."""
    element = new_element(DESIGN, PAPER)
    assert element.chain.integrator is INTEGRATORS['noh_bathe']
    assert element.chain.dt == 0.25 == 0.5 * new_element(DESIGN, FOURTH).chain.dt
    for level in range(4):
        outcome = run(element, Write(level))
        assert (outcome.success, outcome.attempts) == (True, 1)
        assert outcome.reading.level == level
        assert outcome.reading.level_margin > 0.7
    assert run(element, Erase()).success


def test_the_delays_are_free_of_numerical_dispersion():
    """At its step the paper's method slows the carrier, and damps it by a third of eta.

    The factory measures with the fourth-order method whatever the device uses, because the delays
    are those of the element.
    """
    paper, fourth = new_element(CASE_II, PAPER), new_element(CASE_II, FOURTH)
    assert paper.calibration == fourth.calibration
    heard = {}
    for element in (paper, fourth):
        element.chain.place(find_pinned_wall(Specimen(CASE_II), 7))
        element.transducer.assume_equilibrium()
        heard[element] = run(element, Read()).reading.left_delay
    exact = forecast_echo(CASE_II, element.chain.v, FOURTH.probe, End.LEFT, dt=0.0).delay
    assert heard[fourth] == pytest.approx(exact, abs=1.0)  # two samples
    assert abs(heard[paper] - exact) > 2.0


def test_a_snapshot_of_the_other_integrator_is_refused():
    element = new_element(DESIGN, PAPER)
    rig.ticks(element, 5)
    other = new_element(DESIGN, FOURTH)
    before = hash_state(other)
    with pytest.raises(StateError, match=r'steps per tick \(time.tick, time.integrator\)'):
        restore_snapshot(other, take_snapshot(element))
    assert hash_state(other) == before


def test_delays_of_one_integrator_do_not_apply_to_the_other():
    assert calibration_key(CASE_II, FOURTH) != calibration_key(CASE_II, PAPER)


def test_the_design_check_judges_the_damping_by_the_method():
    paper, fourth = (
        Report(tuple(material.check(Subject(CASE_II, each))))['step'] for each in (PAPER, FOURTH)
    )
    assert fourth.verdict is Verdict.PASS
    own = [step.values['own damping'] for step in (paper, fourth)]
    assert own[1] < 1e-2 * own[0] < 0.65 * CASE_II.eta
