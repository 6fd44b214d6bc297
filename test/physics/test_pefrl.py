# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The integrator of fourth order, by what is known of it without knowing its constants.

=========================  =========================================================
property                   must agree with
=========================  =========================================================
a damped oscillator        its closed form; the error falls with dt^4
a step                     shrinks the volume of states as the damping does, no more
energy                     kept without damping, where the paper's method loses a third
stability                  bounded below omega dt = 2.9895, growing above
an echo                    what linear waves say, which no step has damped
=========================  =========================================================

`test_chain` has it follow DOP853 through strain, pulse and damping, `test_specimen` with cells
of their own masses on a base that shakes.
"""

import dataclasses
import math

import numpy as np
import pytest

from mlmem_ros.analysis.echo_forecast import forecast_echo
from mlmem_ros.device import Settings
from mlmem_ros.device.end import End
from mlmem_ros.device.simulation import Simulation
from mlmem_ros.device.transducer import Transducer
from mlmem_ros.physics import CASE_II, NOH_BATHE, PEFRL, Chain, Specimen, StateError, stable_step
from mlmem_ros.physics.energy import energy
from mlmem_ros.physics.equilibrium import resting_wall

UNIFORM = dataclasses.replace(CASE_II, N=26, gamma=0.0, beta=0.0)


def error_of_the_oscillator(design, dt, time=24.0):
    """A uniform chain shifted as a whole: every cell is the same oscillator."""
    amplitude = 1e-6  # harmonic to 1e-6, and 1e10 roundings high
    chain = Chain(design, dt, PEFRL)
    chain.place(np.full(design.N, design.D_s1 + amplitude))
    steps = round(time / dt)
    v_1, _ = (chain.rest(steps) - design.D_s1) / amplitude
    t, eta = dt * np.arange(1, steps + 1), design.eta
    omega = math.sqrt(design.k_s1 - 0.25 * eta * eta)
    exact = np.cos(omega * t) + 0.5 * eta / omega * np.sin(omega * t)
    return np.abs(v_1 - np.exp(-0.5 * eta * t) * exact).max()


@pytest.mark.parametrize('eta', [0.0, 1 / 250, 0.3])
def test_an_oscillator_follows_its_closed_form_to_fourth_order(eta):
    design = dataclasses.replace(UNIFORM, phase=2, eta=eta)
    steps = np.array([1.2, 0.8, 0.6])
    errors = [error_of_the_oscillator(design, dt) for dt in steps]
    slope = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert slope == pytest.approx(4.0, abs=0.15)
    assert errors[-1] < 1e-3  # the paper's method: 1e-2 at 0.3, for as many forces


@pytest.mark.parametrize('eta', [0.0, 1 / 250, 0.3, 5.0])
def test_a_step_shrinks_the_volume_of_states_by_the_damping_alone(eta):
    """Liouville: det = exp(-eta dt), whatever the stiffness and the step."""
    for dt in (0.1, 0.5, 1.2):
        matrix = PEFRL.step_matrix(np.array([0.1, 1.0, 4.5], dtype=complex), eta, dt)
        np.testing.assert_allclose(np.linalg.det(matrix), math.exp(-eta * dt), rtol=1e-13)


def test_undamped_a_packet_keeps_its_energy():
    """In 2000 time units; at a step of 0.25 the paper's method loses more than a third of it."""
    design = dataclasses.replace(CASE_II, eta=0.0)
    rest = resting_wall(Specimen(design), 3)
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


def growth(monkeypatch, omega_dt, steps=400):
    """Return by how much the fastest wave of a uniform chain has grown at its highest."""
    monkeypatch.setattr('mlmem_ros.physics.methods.pefrl.OMEGA_DT_LIMIT', 100.0)
    p = dataclasses.replace(UNIFORM, eta=0.0)
    kappa = np.pi * (p.N - 1) / p.N
    omega = math.sqrt(p.k_s1 + 2.0 - 2.0 * math.cos(kappa))
    chain = Chain(p, omega_dt / omega, PEFRL)
    wave = np.cos(kappa * (p.sites - 0.5))
    chain.place(p.D_s1 + 1e-9 * wave / wave[0])
    try:
        return np.abs(chain.rest(steps) - p.D_s1).max() / 1e-9
    except StateError:  # beyond all numbers
        return math.inf


def test_stable_up_to_its_limit(monkeypatch):
    assert growth(monkeypatch, 2.98) < 20.0  # near the limit the ellipse is long, and bounded
    assert growth(monkeypatch, 3.0) > 1e3


@pytest.mark.parametrize('substrate', ['rigid', 'elastic'])
@pytest.mark.parametrize('eta', [0.0, 1 / 250, 1.0, 10.0])
def test_the_stable_step_is_stable_at_any_damping(substrate, eta):
    design = dataclasses.replace(CASE_II, N=60, substrate=substrate, eta=eta)
    chain = Chain(design, stable_step(Specimen(design), PEFRL), PEFRL)
    rough = 1e-3 * np.random.default_rng(1).standard_normal(design.N)
    chain.place(design.D_s1 + rough)
    chain.rest(4000)
    assert np.abs(chain.v - design.D_s1).max() < 5e-3


@pytest.mark.parametrize('level', [0, 7])
def test_an_echo_is_that_of_linear_waves_without_any_step(level):
    """And the paper's method at its step hears less: it damps the carrier by a third of eta."""
    settings = Settings()
    wall = resting_wall(Specimen(CASE_II), level)
    ideal = forecast_echo(CASE_II, wall, settings.probe, End.LEFT, 0.0)
    peaks = {}
    for method in (PEFRL, NOH_BATHE):
        chain = Chain(CASE_II, integrator=method)
        chain.place(wall)
        transducer = Transducer(CASE_II, settings, Simulation(chain))
        detector = transducer.fire(End.LEFT)
        for _ in range(75):
            steps = round(20.0 / chain.dt)
            drive = transducer.drive(steps)
            rest = np.zeros(steps * method.substeps)
            transducer.record(chain.advance(rest, drive))
        echo = detector.echo(End.LEFT)
        late = echo.t > ideal.delay - 5.0
        peaks[method.name] = float(echo.v_c[late].max())
        if method is PEFRL:
            assert echo.delay == pytest.approx(ideal.delay, abs=1.0)  # two samples
    expected = float(ideal.v_c[ideal.t > ideal.delay - 5.0].max())
    assert peaks['pefrl'] == pytest.approx(expected, rel=0.03)
    assert peaks['noh_bathe'] < peaks['pefrl']
