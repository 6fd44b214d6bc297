# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The paper's equations once more, literally, for SciPy: a second route to every number.

Nothing here is imported from the material or the kernel but the values of a design's symbols
and the type of an array: potential, forces, substrate and integrator are others.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import numpy as np

from mlmem.physics.design import Design
from mlmem.physics.potential import Array

Function = Callable[[float], float]
RightHandSide = Callable[[float, Array], Array]


def on_site_potential(p: Design, D: Any) -> Array:
    """Return the on-site potential of page 3; complex D are welcome."""
    return np.asarray(p.d * (1.0 - np.cos(p.a * (D + p.c) + p.b * (D + p.c) ** 3)))


def psi_prime(p: Design, D: Array) -> Array:
    """Return its derivative by a complex step: exact to rounding, with no formula of its own."""
    return np.asarray(np.imag(on_site_potential(p, np.asarray(D) + 1e-30j)) / 1e-30)


def psi_second(p: Design, D: Array, h: float = 1e-5) -> Array:
    """Return its second derivative by a central difference of the first."""
    return np.asarray((psi_prime(p, D + h) - psi_prime(p, D - h)) / (2.0 * h))


def ground_states(p: Design) -> tuple[float, float]:
    """Return the two minima of psi next to 0, by a scalar minimiser."""
    from scipy.optimize import minimize_scalar

    def find_minimum(low: float, high: float) -> float:
        bounds, options = (low, high), {'xatol': 1e-12}
        found = minimize_scalar(lambda D: on_site_potential(p, D), bounds=bounds, options=options)
        return float(found.x)

    return find_minimum(-1.4, -0.5), find_minimum(0.5, 1.4)


@functools.cache
def site_strength(p: Design) -> Array:
    """Return alpha_j, site by site from its definition, shape (N,): read it only."""
    defects = range(p.J, p.N + 1, p.J)
    return np.array(
        [(1 + p.gamma * j) * (1 + (p.beta if j in defects else 0)) for j in range(1, p.N + 1)]
    )


def substrate_shape(p: Design) -> Array:
    """Return V_j for V_N = 1 from a linear solve of the springs of Eq. (2), shape (N,)."""
    half, slope = p.J_s / 2, 2 * (p.s_max - p.s_min) / p.J_s
    s = np.array([slope * abs((j - p.j_0 - half) % p.J_s - half) + p.s_min for j in range(1, p.N)])
    matrix = np.diag(s[:-1] + s[1:]) - np.diag(s[1:-1], 1) - np.diag(s[1:-1], -1)
    right = np.zeros(p.N - 2)
    right[-1] = s[-1]
    return np.concatenate(([0.0], np.linalg.solve(matrix, right), [1.0]))


def energy_gradient(p: Design, v: Array, V: Array) -> Array:
    """Return dU/dv_j of the metamaterial over a fixed substrate, shape (N,)."""
    padded = np.concatenate(([v[0]], v, [v[-1]]))
    return np.asarray(2 * v - padded[2:] - padded[:-2] + site_strength(p) * psi_prime(p, v - V))


def total_energy(p: Design, v: Array, V: Array) -> float:
    """Return the energy of the metamaterial, springs and potential."""
    return float(
        np.sum(site_strength(p) * on_site_potential(p, v - V)) + 0.5 * np.sum(np.diff(v) ** 2)
    )


def energy_and_gradient(p: Design, v: Array, V: Array) -> tuple[float, Array]:
    """Return `total_energy` and `energy_gradient`, of one complex step."""
    stepped, stretch = on_site_potential(p, v - V + 1e-30j), np.diff(v, prepend=v[0], append=v[-1])
    energy = np.sum(site_strength(p) * stepped.real) + 0.5 * np.sum(stretch**2)
    return float(energy), site_strength(p) * stepped.imag / 1e-30 - np.diff(stretch)


def equation_1a(p: Design, V_N: Function, v_1: Function | None = None) -> RightHandSide:
    """Return d(v, v')/dt of Eq. (1a) over the quasi-static substrate V_j = V_N(t) shape_j.

    Args:
        v_1: Motion of the first cell, whose own rows are then meaningless; None where it is free.
    """
    shape, amplitude = substrate_shape(p), site_strength(p)

    def evaluate_rates(t: float, y: Array) -> Array:
        v, velocity = y[: p.N].copy(), y[p.N :]
        if v_1 is not None:
            v[0] = v_1(t)
        padded = np.concatenate(([v[0]], v, [v[-1]]))
        pull = 2 * v - padded[2:] - padded[:-2]
        on_site = amplitude * psi_prime(p, v - V_N(t) * shape)
        return np.concatenate((velocity, -p.eta * velocity - pull - on_site))

    return evaluate_rates


def integrate_rates(
    rates: RightHandSide, y: Array, span: tuple[float, float], at: Array | None = None
) -> Array:
    """Return the states at times by DOP853 (order 8): the end alone, or shape (len(at), 2 N)."""
    from scipy.integrate import solve_ivp

    found = solve_ivp(rates, span, y, method='DOP853', rtol=1e-9, atol=1e-11, t_eval=at)
    return np.asarray(found.y[:, -1] if at is None else found.y.T)


def kink_energy(p: Design) -> float:
    """Return the energy of the continuum's wall, integral of sqrt(2 psi) over the barrier."""
    from scipy.integrate import quad

    low, high = ground_states(p)
    return float(
        quad(lambda D: np.sqrt(2.0 * on_site_potential(p, D)), low, high, epsabs=1e-12)[0]
    )


def kink_profile(p: Design, x: Array) -> Array:
    """Return the continuum's anti-kink, v' = -sqrt(2 psi), with its barrier crossing at x = 0."""
    from scipy.integrate import solve_ivp
    from scipy.optimize import brentq

    low, high = ground_states(p)
    top = brentq(lambda D: float(psi_prime(p, D)), low + 0.5, high - 0.5, xtol=1e-14)

    def profile_slope(_: float, D: Array) -> Array:
        return -np.sqrt(np.maximum(2.0 * on_site_potential(p, D), 0.0))

    profile = np.empty_like(x)
    for side in (x < 0.0, x >= 0.0):
        order = np.argsort(np.abs(x[side]))
        reach = x[side][order]
        found = solve_ivp(
            profile_slope,
            (0.0, reach[-1]),
            [top],
            t_eval=reach,
            method='DOP853',
            rtol=1e-11,
            atol=1e-13,
        )
        profile[np.flatnonzero(side)[order]] = found.y[0]
    return profile
