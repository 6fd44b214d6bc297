# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""PEFRL, a symplectic integrator of fourth order: five drifts and, between them, four kicks.

Omelyan, Mryglod and Folk, Comput. Phys. Commun. 146 (2002) 188, Eqs. (20) and (22): the
position-extended Forest-Ruth-like scheme. A drift moves the displacements at fixed velocities. A
kick solves m v' = f - eta v exactly at fixed displacements, so that damping does not lower the
order. Time advances with the drifts: the prescribed motion is evaluated at the stages' own times.
Undamped it loses no energy in the long run, and small waves keep their amplitude: the only damping
of an echo is the material's. The paper's own method, that of Noh and Bathe, damps the carrier of a
pulse by a third of eta at the paper's step.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .cells import Cells, Chained, Forcing, align_array, is_below_speed
from .formulas import coupling_pull, dry_friction, exponential, join_motion, on_site_factors
from .jit import compile_kernel, fma
from .values import Array, Complex

XI, LAMBDA, CHI = 0.1786178958448091, -0.2123418310626054, -0.06626458266981849

DRIFT_FRACTIONS = (XI, CHI, 1.0 - 2.0 * (CHI + XI), CHI, XI)
"""Fractions of the step."""

KICK_FRACTIONS = (0.5 - LAMBDA, LAMBDA, LAMBDA, 0.5 - LAMBDA)
"""Fractions of the step, between the drifts."""

NODES = (XI + CHI, XI, 1.0 - XI, 1.0 - XI - CHI, 1.0)
"""The times in a step at which the prescribed motion (strain, base, driven cell) is needed, as
fractions of the step: rising, the last one 1."""

SUBSTEPS_PER_STEP = len(NODES)
"""Set-points of the prescribed motion in a step."""

MAX_ACCURATE_STEP = 0.5
"""Largest step with the rigid substrate, in time units: 6 steps in a period of the carrier."""

MAX_ACCURATE_PHASE = 1.2
"""Largest omega dt of the cells: they swing from barrier to barrier, and steps that are stable for
small waves only were seen to heat them until they diverged."""

MAX_STABLE_PHASE = 2.98
"""Largest omega dt considered stable. Undamped it is 2.9895, and damping only adds to it."""


class StepConstants(NamedTuple):
    """The constants of a step; rows: for the outer kicks, then the inner ones.

    Attributes:
        drifts: Lengths in time, shape (5,).
        decay, kick, push: The effect of a kick on velocity v, with force f and base acceleration
            A: v' = decay v + kick f - push A, by cell, shape (2, >= N).
        substrate_decay, substrate_kick: The same of a substrate cell, of mass 1, whose kick and
            push are one, shape (2,).
    """

    drifts: Array
    decay: Array
    kick: Array
    push: Array
    substrate_decay: Array
    substrate_kick: Array


@compile_kernel
def advance(
    steps: int,
    chain: Chained,
    substrate: Chained | None,
    cells: Cells,
    forcing: Forcing,
    constants: StepConstants,
    ends: Array,
    friction: tuple[float, float] | None,
    drag: Array | None,
) -> tuple[int, bool]:
    """Advance Eq. (1a), and over an elastic substrate Eq. (1b).

    Args:
        chain: u, du and two rows of displacements x: those at a kick, and those after the
            following drift.
        substrate: The same of an elastic substrate, whose two ends belong to the frame and the
            actuator: they are moved, not integrated, and their velocities read zero. None for a
            rigid one, V_j = V_N shape_j; the elastic part is then not compiled.
        forcing: What is prescribed, in order of time. The stages are not: the second goes back. A
            step not driven to its end is free.
        constants: Of a step.
        ends: Out: displacement of the first and the last cell after every step, (2, steps).
        friction: Force and creep of dry friction, which lowers the order to one; None for none,
            which is then not compiled.
        drag: eta times the velocity of the substrate's end, in order of time, where damping acts
            on the motion relative to a rigid substrate; None where it acts on v, which is then
            not compiled.

    Returns:
        The number of steps done, and whether a cell was out of range at a check.
    """
    u, du, x = chain
    if substrate is not None:
        U, dU, X = substrate
    law, spring, origin, mobility, under, stuck = cells
    V_N, shake, site, driven, motion, every, low, high, limit, before = forcing
    drifts, decay, kick, push, substrate_decay, substrate_kick = constants
    n, done, strayed = len(du), steps, False

    for j in range(1, n + 1):
        x[0, j] = u[j]
        if substrate is not None:
            X[0, j] = U[j]
    for k in range(steps):
        i = 5 * k
        held = i + 5 <= driven
        for j in range(n):
            x[0, j + 1] = fma(drifts[0], du[j], x[0, j + 1])
            if substrate is not None:
                X[0, j + 1] = fma(drifts[0], dU[j], X[0, j + 1])
        for stage in range(4):  # kick at x[at], then drift to x[to]
            at, to = stage % 2, 1 - stage % 2
            by = (stage + 1) // 2 % 2
            node = i + (1 - stage % 2) + stage // 2 * 2
            end, base, drift = V_N[node], shake[node], drifts[stage + 1]
            if held:
                x[at, site] = motion[0, node]
            x[at, 0] = x[at, 1]
            x[at, n + 1] = x[at, n]
            if substrate is not None:
                X[at, 1] = 0.0
                X[at, n] = end
                under_decay, under_kick = substrate_decay[by], substrate_kick[by]
            else:
                for j in stuck:
                    x[at, j + 1] = fma(end - before, under[j], x[at, j + 1])
            before = end
            for j in range(n):
                here = x[at, j + 1]
                if substrate is None:
                    y = here - fma(end, under[j], origin[j])
                else:
                    HERE = X[at, j + 1]
                    y = here - (HERE + origin[j])
                slope, sine = on_site_factors(law, j, y)
                pull = fma(-slope, sine, coupling_pull(spring, j, x[at, j], here, x[at, j + 2]))
                if drag is not None:
                    pull = fma(drag[node], under[j], pull)
                if friction is not None:
                    pull = pull - dry_friction(friction, du[j])
                velocity = fma(decay[by, j], du[j], fma(kick[by, j], pull, -push[by, j] * base))
                du[j] = velocity
                x[to, j + 1] = fma(drift, velocity, here)
                if substrate is not None:
                    tension = under[j + 1] * (X[at, j + 2] - HERE)
                    pull = fma(-under[j], HERE - X[at, j], tension)
                    pull = fma(slope, sine, pull) - base
                    velocity = fma(under_decay, dU[j], under_kick * pull)
                    dU[j] = velocity
                    X[to, j + 1] = fma(drift, velocity, HERE)
            for j in stuck:
                if substrate is None:
                    x[to, j + 1] = x[at, j + 1]
                    du[j] = 0.0
                else:
                    du[j] = dU[j] = join_motion(mobility[j], du[j], dU[j])
                    x[to, j + 1] = fma(drift, du[j], x[at, j + 1])
                    X[to, j + 1] = fma(drift, du[j], X[at, j + 1])
        if substrate is None:
            for j in stuck:
                x[0, j + 1] = fma(V_N[i + 4] - before, under[j], x[0, j + 1])
            before = V_N[i + 4]
        else:
            X[0, 1] = 0.0
            X[0, n] = V_N[i + 4]
            dU[0] = dU[n - 1] = 0.0
        if held:
            x[0, site] = motion[0, i + 4]
            du[site - 1] = motion[1, i + 4]
        ends[0, k] = x[0, 1]
        ends[1, k] = x[0, n]
        if (k + 1) % every == 0:
            end = V_N[i + 4]
            for j in range(n):
                D = x[0, j + 1] - (end * under[j] if substrate is None else X[0, j + 1])
                if not low <= D <= high:  # also true for NaN
                    strayed = True
            calm = is_below_speed(du, limit)
            if substrate is not None:
                calm = calm and is_below_speed(dU, limit)
            if calm:
                done = k + 1
                break
    for j in range(1, n + 1):
        u[j] = x[0, j]
        if substrate is not None:
            U[j] = X[0, j]
    return done, strayed


def limit_step(omega: float) -> float:
    """Return the largest step considered stable, for the greatest angular frequency of undamped
    small waves.
    """
    return MAX_STABLE_PHASE / omega


def compute_constants(dt: float, mobility: Array, eta: Array | float) -> StepConstants:
    """Return the constants of a step.

    Args:
        dt: Step size in time units.
        mobility: Inverse masses, shape (N,), 0 for a stuck cell.
        eta: Damping; or that of every cell, shape (N,), over a rigid substrate.
    """
    kicks = np.array([_compute_kick(share * dt, mobility, eta) for share in KICK_FRACTIONS[:2]])
    of_one = np.array([_compute_kick(share * dt, np.ones(1), eta) for share in KICK_FRACTIONS[:2]])
    decay, kick, push = (align_array(kicks[:, k]) for k in range(3))
    substrate = (of_one[:, k, 0].copy() for k in range(2))
    return StepConstants(np.array(DRIFT_FRACTIONS) * dt, decay, kick, push, *substrate)


def step_matrix(stiffness: Complex, eta: float, dt: float) -> Complex:
    """Return the matrix of a step of an oscillator of unit mass on its state (u, du).

    Args:
        stiffness: Shape (m,).
        eta: Damping.
        dt: Step size in time units.

    Returns:
        Shape (m, 2, 2).
    """
    u, du = np.eye(2, dtype=np.complex128)[:, None, :] * np.ones((len(stiffness), 1))
    for number, share in enumerate(DRIFT_FRACTIONS):
        u = u + share * dt * du
        if number < len(KICK_FRACTIONS):
            decay, kick, _ = _compute_kick(KICK_FRACTIONS[number] * dt, np.ones(1), eta)
            du = decay * du - kick * stiffness[:, None] * u
    return np.stack((u, du), axis=1)


def squared_frequency(omega: Array | Complex, eta: float, dt: float) -> Complex:
    """Return the effective stiffness (unit mass) of the scheme for a wave of a frequency.

    A harmonic motion exp(i omega t) solves u'' + eta u' + w u = 0 for w = omega^2 - i eta omega.
    For the scheme's discrete motion w differs by its dispersion: it is the w for which
    exp(i omega dt) is an eigenvalue of the step, found by the secant method.

    Args:
        omega: Angular frequencies, shape (m,).
        eta: Damping.
        dt: Step size in time units; 0 gives the exact value.

    Returns:
        w, shape (m,).
    """
    exact = np.asarray(omega**2 - 1j * eta * omega, dtype=np.complex128)
    if dt == 0.0:
        return exact
    turn = np.exp(1j * omega * dt)
    before, w = exact, exact * (1.0 + 1e-4)
    miss_before, miss = (_compute_residual(each, turn, eta, dt) for each in (before, w))
    for _ in range(12):
        change = miss - miss_before
        moving = np.abs(change) > 1e-300
        step = np.where(moving, miss * (w - before) / np.where(moving, change, 1.0), 0.0)
        before, w, miss_before = w, w - step, miss
        if np.abs(step).max(initial=0.0) < 1e-12:
            break
        miss = _compute_residual(w, turn, eta, dt)
    return np.asarray(w)


def _compute_residual(w: Complex, turn: Complex, eta: float, dt: float) -> Complex:
    """Return det(M(w) - turn), M the matrix of a step, shape (m,)."""
    return np.asarray(np.linalg.det(step_matrix(w, eta, dt) - turn[:, None, None] * np.eye(2)))


def _compute_kick(h: float, mobility: Array, eta: Array | float) -> tuple[Array, Array, Array]:
    """Return the coefficients of a kick of a given duration.

    v' = decay v + kick f - push A with decay = exp(-z), push = h (1 - exp(-z)) / z and
    kick = push / m, where z = eta h / m; the fraction by its series where z is small.
    """
    z = eta * h * mobility
    decay = exponential(-z)
    series = np.ones_like(z)
    for order in range(12, 0, -1):
        series = 1.0 - z * series / (order + 1.0)
    large = np.abs(z) > 0.1
    share = np.where(large, (1.0 - decay) / np.where(large, z, 1.0), series)
    push = h * share
    return decay, push * mobility, push
