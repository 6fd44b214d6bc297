# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Runs of the real loops that have a closed form, for the tests of either method.

A chain with gamma = beta = 0 shifted as a whole stretches no spring: every cell is the same
oscillator of stiffness k_s.
"""

import dataclasses
import math

import numpy as np

from mlmem.physics import CASE_II, Chain, StateError, stable_step
from mlmem.physics.formulas import on_site_factors
from mlmem.physics.jit import compile_kernel

UNIFORM = dataclasses.replace(CASE_II, N=26, gamma=0.0, beta=0.0)


@compile_kernel
def on_site_force(constants, y):
    """Return the on-site force as the loops compute it, shape (m,), of a cell without scatter."""
    found = np.empty_like(y)
    for k in range(len(y)):
        slope, factor = on_site_factors(constants, 1, y[k])
        found[k] = slope * factor
    return found


def oscillator_error(design, dt, method, time=24.0):
    """Return the largest error of a damped oscillator that starts at 1, at rest."""
    amplitude = 1e-6  # harmonic to 1e-6, and 1e10 roundings high
    chain = Chain(design, dt, method)
    chain.place(np.full(design.N, design.D_s1 + amplitude))
    steps = round(time / dt)
    v_1, v_N = (chain.advance_steps(steps) - design.D_s1) / amplitude
    np.testing.assert_allclose(v_N, v_1, atol=1e-8)  # as a whole
    t, eta = dt * np.arange(1, steps + 1), design.eta
    omega = math.sqrt(design.k_s1 - 0.25 * eta * eta)
    exact = np.cos(omega * t) + 0.5 * eta / omega * np.sin(omega * t)
    return np.abs(v_1 - np.exp(-0.5 * eta * t) * exact).max()


def order(design, steps, method):
    """Return the order of a method, and its error at the last of some steps."""
    errors = [oscillator_error(design, dt, method) for dt in steps]
    return np.polyfit(np.log(steps), np.log(errors), 1)[0], errors[-1]


def growth(monkeypatch, omega_dt, method, eta=0.0, steps=400):
    """Return by how much the fastest wave of a uniform chain has grown at its highest."""
    monkeypatch.setattr(type(method), 'stable_turn', 100.0)
    p = dataclasses.replace(UNIFORM, eta=eta)
    kappa = np.pi * (p.N - 1) / p.N
    omega = math.sqrt(p.k_s1 + 2.0 - 2.0 * math.cos(kappa))
    chain = Chain(p, omega_dt / omega, method)
    wave = np.cos(kappa * (p.sites - 0.5))
    chain.place(p.D_s1 + 1e-9 * wave / wave[0])
    try:
        return np.abs(chain.advance_steps(steps) - p.D_s1).max() / 1e-9
    except StateError:  # beyond all numbers
        return math.inf


def at_the_stable_step(substrate, eta, method):
    """Return a chain after a rough start at the largest step allowed."""
    design = dataclasses.replace(CASE_II, N=60, substrate=substrate, eta=eta)
    chain = Chain(design, stable_step(design, method), method)
    chain.place(design.D_s1 + 1e-3 * np.random.default_rng(1).standard_normal(design.N))
    chain.advance_steps(4000)
    assert np.abs(chain.v - design.D_s1).max() < 5e-3
    return chain
