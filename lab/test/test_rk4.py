# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The element with equations and an integrator of its own, alone and behind an emulated rig."""

import dataclasses

import numpy as np
import pytest

from mlmem import Settings
from mlmem.instrument.end import Pulse
from mlmem.physics import CASE_II, Chain, HeldCell, Scatter, Specimen, draw_specimen
from mlmem.physics.equilibrium import find_pinned_wall
from mlmem.physics.stepping import substep_times
from mlmem_lab.rk4 import Rk4Element

DT = 0.25
PULSE = Settings().probe


def probed(element, samples=2400):
    """Fire the left pulse while the strain rises, and return the samples of both ends."""
    times = DT * np.arange(1, samples + 1)
    held = times[times <= 12 * PULSE.sigma]
    motion = Pulse(element.end(1), PULSE).evaluate_motion(held)
    return element.advance(1e-4 * times, HeldCell(1, motion))


@pytest.mark.parametrize('relative', [False, True])
def test_rk4_element_agrees_with_the_chain(relative):
    """An echo of another integrator, another interpolation: 1e-4 of the pulse."""
    parts = 4  # steps of a sample
    made = draw_specimen(CASE_II, Scatter(alpha=0.01, k_r=0.01, s=0.01, mass=0.003), 5)
    made = dataclasses.replace(made, damped_by_substrate=relative)
    ours = Rk4Element(made, DT, step=0.05)
    theirs = Chain(made, DT / parts)
    ours.v[:] = find_pinned_wall(made, 2)
    theirs.place(find_pinned_wall(made, 2))
    found = probed(ours)
    times = substep_times(2400 * parts, DT / parts)
    motion = Pulse(theirs.end(1), PULSE).evaluate_motion(times[times <= 12 * PULSE.sigma])
    expected = theirs.advance(1e-4 * times, HeldCell(1, motion))[:, parts - 1 :: parts]
    assert np.abs(expected - expected[:, :1]).max() > 5e-3  # it was probed
    assert found == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize(('push', 'slides'), [(0.9e-5, False), (1.1e-5, True)])
def test_dry_friction_holds_against_a_smaller_force(push, slides):
    """All cells are pushed alike: off their ground state by push / k_s1."""
    element = Rk4Element(Specimen(CASE_II), DT, friction=1e-5)
    uniform = Specimen(CASE_II, alpha_factor=1.0 / CASE_II.alpha)
    element.specimen = uniform
    element.v[:] = CASE_II.D_s1 + push / CASE_II.k_s1
    before = element.v.copy()
    element.advance(np.zeros(4000))
    moved = np.abs(element.v - before).max()
    assert moved > 1e-6 if slides else moved < 1e-12
