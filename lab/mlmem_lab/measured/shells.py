# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Waves of shells as their force curves have them: laws, magnets, and a loop for many chains.

A posterior needs some hundred thousand waves. `launch_waves` steps chains of equal shells, with
laws and magnets from tables, in half a millisecond each; `test_measured_curves.py` compares it
with a `Lattice`. Units: g, cm, ms; force in 10 N.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.optimize import least_squares

from mlmem.physics.jit import compile_kernel
from mlmem.physics.values import Array

from .runs import DATA_FOLDER

ELEMENT_MASS_G = 21.0

TESTS_BY_RAIL = {
    21.5: ('180mm_run29', '180mm_run30', '180mm_run32'),
    22.0: ('22mm_run11', '22mm_run13', '185mm_run22'),
    22.5: ('225mm_run1', '225mm_run2'),
}
"""The force tests of one shell that belong to a distance of the rails, by their second well."""

LAW_BOUNDS = (-1.0, 2.0)
"""Ends of the table of a law, over the place of the second well: 601 points, 200 to the well."""

MIN_MAGNET_DISTANCE_CM = 0.3
"""Distance below which the repulsion of the magnets grows no more."""


@cache
def load_force_table(name: str) -> tuple[Array, float]:
    """Return a force test as a table over `LAW_BOUNDS` of its way, 10 N, and its second well, cm.

    Before its first and beyond its last point it goes on straight.
    """
    D, force = np.loadtxt(
        DATA_FOLDER / 'force' / f'{name}.csv', delimiter=',', skiprows=1, usecols=(0, 1),
        unpack=True,
    ) / 10.0  # fmt: skip
    rising = np.flatnonzero((force[:-1] < 0.0) & (force[1:] >= 0.0))[-1]
    well = float(np.interp(0.0, force[rising : rising + 2], D[rising : rising + 2]))
    first, last = (np.polyfit(D[part], force[part], 1)[0] for part in (slice(8), slice(-8, None)))
    zero = D[0] - force[0] / first
    x = zero + (well - zero) * np.linspace(*LAW_BOUNDS, 601)
    found = np.interp(x, D, force)
    found = np.where(x < D[0], force[0] + first * (x - D[0]), found)
    found = np.where(x > D[-1], force[-1] + last * (x - D[-1]), found)
    return found, well - zero


@cache
def fit_magnets() -> tuple[float, float, float]:
    """Return A, b and p of the repulsion A (r + b)^-p, as measured up close and far apart."""
    travel, force = np.loadtxt(
        DATA_FOLDER / 'force' / 'magnets.csv', delimiter=',', skiprows=1, unpack=True
    )
    # 10 N by cm: what was measured at the spacings of a longer travel than the file has
    far_repulsion = {6.0: 0.0420, 7.0: 0.0232, 8.0: 0.0134}
    near = np.linspace(0, len(travel) - 1, 3 * len(far_repulsion)).astype(int)
    contact_distance_mm = 142.0  # distance of the magnets at no travel, mm
    r = np.append((contact_distance_mm - travel[near]) / 10.0, list(far_repulsion))
    pushed = np.log(np.append(force[near] / 10.0, list(far_repulsion.values())))

    def force_residual(x: Array) -> Array:
        return np.asarray(x[0] - x[2] * np.log(r + x[1]) - pushed)

    A, b, p = least_squares(force_residual, [12.0, 3.7, 6.5]).x
    return float(np.exp(A)), float(b), float(p)


@cache
def tabulate_repulsion() -> Array:
    """Return the table of the magnets, 10 N, for each hundredth of a cm from 0 to 20 cm."""
    A, b, p = fit_magnets()
    r = np.arange(0.0, 20.0, 0.01)
    return np.asarray(A * (np.maximum(r, MIN_MAGNET_DISTANCE_CM) + b) ** -p)


@dataclass(frozen=True)
class Chains:
    """Chains of equal shells, every field but the laws of shape (n,).

    Attributes:
        laws: Tables of force over the way to the second well, 10 N, shape (n, 601).
        well: Second well, cm.
        spacing: Of the elements, cm.
        tilt: Constant force along the wave, 10 N.
        damping: Rate of viscous drag, per ms.
        snap: Its rate in the middle of the way, in addition.
        magnets: Factor on the repulsion.
        hand: Time in which the first element is pushed over, ms.
    """

    laws: Array
    well: Array
    spacing: Array
    tilt: Array
    damping: Array
    snap: Array
    magnets: Array
    hand: Array

    def compute_gain(self) -> Array:
        """Return the energy that a passage sets free, mJ."""
        inside = slice(round(-LAW_BOUNDS[0] * 200), round((1.0 - LAW_BOUNDS[0]) * 200) + 1)
        return np.asarray(100.0 * self.well * (self.tilt - self.laws[:, inside].mean(axis=1)))


def launch_waves(chains: Chains, dt: float = 0.4) -> tuple[Array, Array, Array]:
    """Return speed (m/s) and rise (ms) over the tracked elements, and how many passed half-way.

    Speed and rise are NaN where the wave does not pass. A rise is from a tenth to nine tenths.
    """
    n = len(chains.well)
    found = np.empty((n, 3))
    numbers = np.array((
        chains.well, chains.spacing, chains.tilt, chains.damping, chains.snap, chains.magnets,
        chains.hand,
    ))  # fmt: skip
    _run_chains(np.ascontiguousarray(chains.laws), numbers, tabulate_repulsion(), dt, found)
    return found[:, 0], found[:, 1], found[:, 2]


@compile_kernel
def _run_chains(laws: Array, numbers: Array, near: Array, dt: float, found: Array) -> None:
    """Step each chain by the leap-frog method, drag in the middle."""
    n = 26  # elements, the driven one and the last, which is held, included
    first, last = 7, 10  # the tracked elements, 8 to 11 counting the driven one as 1
    well, spacing, tilt, damping, snap, magnets, hand = numbers
    u, v, f = np.zeros(n), np.zeros(n), np.zeros(n)
    marks = np.zeros((3, n))
    per = (laws.shape[1] - 1) / 3.0
    for k in range(len(well)):
        w, D = well[k], spacing[k]
        stiffness = (laws[k, 201] - laws[k, 200]) * per / w
        u[:] = tilt[k] / stiffness
        v[:] = 0.0
        marks[:] = np.nan
        rest = near[int(D * 100.0)]
        step = 0
        passed, since = 0, hand[k]
        while True:
            step += 1
            t = step * dt
            x = min(t / hand[k], 1.0)
            u[0] = w * x * x * (3.0 - 2.0 * x)
            push = 0.0
            for j in range(1, n):  # the push of the magnets from the left, minus that at rest
                r = max(min(D + u[j] - u[j - 1], 19.9), 0.0) * 100.0
                i = int(r)
                from_left = magnets[k] * (near[i] + (r - i) * (near[i + 1] - near[i]) - rest)
                if j > 1:
                    f[j - 1] = push - from_left
                push = from_left
            for j in range(1, n - 1):
                y = min(max((u[j] / w + 1.0) * per, 0.0), laws.shape[1] - 2.0)
                i = int(y)
                force = f[j] - laws[k, i] - (y - i) * (laws[k, i + 1] - laws[k, i]) + tilt[k]
                s = u[j] / w
                rate = damping[k]
                if 0.0 < s < 1.0:
                    rate += snap[k] * 16.0 * s * s * (1.0 - s) * (1.0 - s)
                drag = 0.5 * dt * rate
                v[j] = ((1.0 - drag) * v[j] + dt * force / ELEMENT_MASS_G) / (1.0 + drag)
                before = u[j]
                u[j] += dt * v[j]
                for m in range(3):
                    level = w * (0.1 + 0.4 * m)
                    if before < level <= u[j] and np.isnan(marks[m, j]):
                        marks[m, j] = t + dt * (level - before) / (u[j] - before)
                        if m == 1 and j > passed:
                            passed, since = j, t
            # a wave has stopped that is slower than 0.4 m/s at 8 cm
            if not np.isnan(marks[2, last]) or t - since > 200.0:
                break
        late, early = marks[1, last], marks[1, first]
        found[k, 0] = 10.0 * D * (last - first) / (late - early)
        total = 0.0
        for j in range(first, last + 1):
            total += marks[2, j] - marks[0, j]
        found[k, 1] = total / (last - first + 1)
        found[k, 2] = passed
