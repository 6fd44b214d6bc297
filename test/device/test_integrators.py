# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A device with the paper's integrator, beside one with the fourth-order one, the default."""

import pytest

from mlmem import Read, Settings, new_element
from mlmem.instrument.end import End
from mlmem.physics import CASE_II, Specimen
from mlmem.physics.equilibrium import find_pinned_wall
from mlmem.settings import TimeSettings
from mlmem_ros.host.design_check import Verdict
from mlmem_tools.checks import Report, material
from mlmem_tools.checks.concern import Subject
from mlmem_tools.checks.echoes import forecast_echo

from .rig import run

FOURTH, PAPER = Settings(), Settings(time=TimeSettings(integrator='noh_bathe'))


def test_delays_are_free_of_numerical_dispersion():
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


def test_design_check_judges_damping_by_method():
    paper, fourth = (
        Report(tuple(material.check(Subject(CASE_II, each))))['step'] for each in (PAPER, FOURTH)
    )
    assert fourth.verdict is Verdict.PASS
    own = [step.values['own damping'] for step in (paper, fourth)]
    assert own[1] < 1e-2 * own[0] < 0.65 * CASE_II.eta
