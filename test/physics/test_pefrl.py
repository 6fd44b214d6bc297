# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The integrator of fourth order, by properties that do not depend on its constants.

=========================  =========================================================
property                   must agree with
=========================  =========================================================
a damped oscillator        its closed form; the error falls with dt^4
a step                     shrinks the volume of states as the damping does, no more
energy                     kept without damping, where the paper's method loses a third
stability                  bounded below omega dt = 2.9895, growing above
=========================  =========================================================

`test_chain` has it follow DOP853 through strain, pulse and damping, `test_specimen` with cells
of their own masses on a base that shakes.
"""

import dataclasses
import math

import numpy as np
import pytest
import uniform_chain

from mlmem.physics import CASE_II, NOH_BATHE, PEFRL, Chain, Specimen
from mlmem.physics.energy import energy
from mlmem.physics.equilibrium import find_pinned_wall


@pytest.mark.parametrize('eta', [0.0, 1 / 250, 0.3])
def test_oscillator_follows_closed_form_to_fourth_order(eta):
    design = dataclasses.replace(uniform_chain.UNIFORM, phase=2, eta=eta)
    order, error = uniform_chain.order(design, (1.2, 0.8, 0.6), PEFRL)
    assert order == pytest.approx(4.0, abs=0.15)
    assert error < 1e-3  # the paper's method: 1e-2 at 0.3, for as many forces


@pytest.mark.parametrize('eta', [0.0, 1 / 250, 0.3, 5.0])
def test_step_shrinks_volume_of_states_by_damping_alone(eta):
    """Liouville: det = exp(-eta dt), whatever the stiffness and the step."""
    for dt in (0.1, 0.5, 1.2):
        matrix = PEFRL.step_matrix(np.array([0.1, 1.0, 4.5], dtype=complex), eta, dt)
        np.testing.assert_allclose(np.linalg.det(matrix), math.exp(-eta * dt), rtol=1e-13)


def test_undamped_packet_keeps_its_energy():
    """In 2000 time units; at a step of 0.25 the paper's method loses more than a third of it."""
    design = dataclasses.replace(CASE_II, eta=0.0)
    rest = find_pinned_wall(Specimen(design), 3)
    packet = 0.01 * np.exp(-(((design.sites - 40.0) / 8.0) ** 2)) * np.sin(1.2 * design.sites)
    kept = {}
    for method in (PEFRL, NOH_BATHE):
        chain = Chain(design, integrator=method)
        chain.place(rest)
        ground = energy(chain).total
        chain.place(rest + packet)
        start = energy(chain).total - ground
        chain.rest(round(2000.0 / chain.dt))
        kept[method.name] = (energy(chain).total - ground) / start
    assert kept['pefrl'] == pytest.approx(1.0, abs=3e-3)  # it swings by (omega dt)^4 / 1000
    assert kept['noh_bathe'] < 0.8


def test_step_is_stable_up_to_its_limit(monkeypatch):
    # Near the limit the ellipse is long, and bounded.
    assert uniform_chain.growth(monkeypatch, 2.98, PEFRL) < 20.0
    assert uniform_chain.growth(monkeypatch, 3.0, PEFRL) > 1e3


@pytest.mark.parametrize('substrate', ['rigid', 'elastic'])
@pytest.mark.parametrize('eta', [0.0, 1 / 250, 1.0, 10.0])
def test_stable_step_is_stable_at_any_damping(substrate, eta):
    uniform_chain.at_the_stable_step(substrate, eta, PEFRL)
