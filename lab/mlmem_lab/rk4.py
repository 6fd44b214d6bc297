# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An element that is simulated otherwise: what a fit or a plan is tried on.

Eq. (1a) by the classical Runge-Kutta method of fourth order, at a step much finer than that of the
package's own chains. It may rub as a real element does: dry friction, and damping of the motion
relative to the substrate instead of the absolute one. Between two set-points it interpolates.

It is the reference for everything that drives an element.
"""

from __future__ import annotations

import math

import numpy as np

from mlmem import Driver, SettingsError
from mlmem.physics import HeldCell, Specimen, StateError
from mlmem.physics.cells import Cells
from mlmem.physics.equilibrium import relax_to_equilibrium
from mlmem.physics.formulas import on_site_factors
from mlmem.physics.jit import compile_kernel, inline_function
from mlmem.physics.values import Array


class Rk4Element(Driver):
    """An element over a rigid substrate, blank and at rest at first.

    Attributes:
        v: Displacements, shape (N,).
        velocity: Velocities, shape (N,).
    """

    def __init__(
        self,
        specimen: Specimen,
        dt: float,
        *,
        step: float = 0.0625,
        friction: float = 0.0,
        damping: Array | float = 1.0,
        harmonic: float = 0.0,
    ) -> None:
        """Make an element.

        Args:
            dt: Time between samples, in time units.
            step: Greatest step; by default a carrier of 1.5 is 1e-3 rad off after 900 time units.
            friction: Dry (Coulomb) friction of a cell against the substrate, in k_r cells; it
                holds a cell at rest against a smaller force.
            damping: Of a cell over the specimen's, shape (N,).
            harmonic: Force of a third harmonic of the on-site energy, over that of the first.

        Raises:
            SettingsError: A number is out of range, the substrate is elastic, or wells differ in
                depth.
        """
        if specimen.design.substrate != 'rigid':
            raise SettingsError.out_of_range('substrate', specimen.design.substrate, 'rigid')
        if specimen.depths.any():
            raise SettingsError.out_of_range('depth', specimen.depths, '0 in every cell')
        if not 0.0 < step <= 0.25:
            raise SettingsError.out_of_range('step', step, 'above 0, up to 0.25 time units')
        if not 0.0 <= friction < math.inf:
            raise SettingsError.out_of_range('friction', friction, 'at least 0')
        self.specimen, self.dt, self.V_N = specimen, dt, 0.0
        blank = specimen.design.D_s1 + specimen.offsets
        self.v = relax_to_equilibrium(specimen, blank, np.zeros_like(blank))
        self.velocity = np.zeros_like(self.v)
        self._steps = math.ceil(dt / step)
        self._friction, self._harmonic = friction, harmonic
        self._eta = specimen.eta * damping * np.ones(specimen.design.N)

    def advance(
        self,
        V_N: Array,
        held_cell: HeldCell | None = None,
        shake: Array | None = None,
        ticks: int = 1,
    ) -> Array:
        """Return the samples of both ends; see `Driver.advance`."""
        made = self.specimen
        site, motion = (held_cell.site, held_cell.motion) if held_cell else (1, np.empty((2, 0)))
        ends = np.empty((2, len(V_N)))
        v, velocity = self.v.copy(), self.velocity.copy()
        p, springs = made.potential, np.concatenate(([0.0], made.k_r, [0.0]))
        cells = Cells(
            p.constants(made.alpha * p.d), (springs,), made.offsets + p.origin, 1.0 / made.masses,
            made.strain_shape, np.flatnonzero(np.isinf(made.masses)),
        )  # fmt: skip
        way = np.ascontiguousarray(V_N), site, np.ascontiguousarray(motion)
        _advance_samples(
            v, velocity, self.V_N, *way, self.dt, self._steps, cells,
            made.damped_by_substrate, self._friction, self._eta, self._harmonic, ends,
        )  # fmt: skip
        if not (np.isfinite(v).all() and np.isfinite(velocity).all()):
            raise StateError(reason='the element stopped being finite: it is strained too hard')
        self.v, self.velocity = v, velocity
        self.V_N = float(V_N[-1]) if len(V_N) else self.V_N
        return ends

    def end(self, site: int) -> float:
        """Return the displacement of an end."""
        return float(self.v[site - 1])


@compile_kernel
def _advance_samples(
    v: Array,
    velocity: Array,
    V_N: float,
    set_points: Array,
    site: int,
    motion: Array,
    dt: float,
    steps: int,
    cells: Cells,
    relative: bool,
    friction: float,
    eta: Array,
    harmonic: float,
    ends: Array,
) -> None:
    """Advance by samples of several steps each.

    Args:
        v: In and out: displacements, shape (N,).
        velocity: In and out: velocities, shape (N,).
        set_points: The same at the end of every sample, shape (n,); linear in between.
        motion: Its displacement and velocity at the end of its samples, shape (2, m), m <= n; a
            cubic in between.
        ends: Out: displacement of both ends after every sample, shape (2, n).
    """
    # times and shares of the stages in a step, as fractions of it
    stage_times = (0.0, 0.5, 0.5, 1.0)
    stage_weights = (1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0)
    law, (k_r,), origin, mobility, under, _ = cells
    n, h = len(v), dt / steps
    x, u = np.empty(n + 2), np.empty(n)
    rate, kick = np.zeros(n), np.zeros(n)
    stop = np.zeros(n)  # the force that stops a cell of unit speed within a step
    for j in range(n):
        if mobility[j] > 0.0:
            stop[j] = 1.0 / (mobility[j] * h)
    by, bv = v[site - 1], velocity[site - 1]  # where the held end comes from
    for k in range(len(set_points)):
        speed = (set_points[k] - V_N) / dt
        held = k < motion.shape[1]
        for step in range(steps):
            next_v, next_velocity = v.copy(), velocity.copy()
            for stage in range(4):
                share, time = stage_times[stage] * h, (step + stage_times[stage]) * h
                end, weight = V_N + speed * time, stage_weights[stage] * h
                for j in range(n):
                    x[j + 1] = v[j] + share * rate[j]
                    u[j] = velocity[j] + share * kick[j]
                if held:
                    x[site], u[site - 1] = _interpolate_cubic(
                        time / dt, dt, by, bv, motion[0, k], motion[1, k]
                    )
                x[0], x[n + 1] = x[1], x[n]
                for j in range(n):
                    slope, sine = on_site_factors(law, j, x[j + 1] - (end * under[j] + origin[j]))
                    sine += harmonic * (3.0 * sine - 4.0 * sine**3)
                    slip = u[j] - speed * under[j]
                    damped = slip if relative else u[j]
                    springs = k_r[j + 1] * (x[j + 2] - x[j + 1]) - k_r[j] * (x[j + 1] - x[j])
                    pull = springs - slope * sine - eta[j] * damped
                    needed = pull + stop[j] * slip
                    rate[j] = u[j]
                    kick[j] = mobility[j] * (pull - min(max(needed, -friction), friction))
                    next_v[j] += weight * rate[j]
                    next_velocity[j] += weight * kick[j]
            for j in range(n):
                v[j], velocity[j] = next_v[j], next_velocity[j]
            if held:
                v[site - 1], velocity[site - 1] = _interpolate_cubic(
                    (step + 1) / steps, dt, by, bv, motion[0, k], motion[1, k]
                )
        V_N = set_points[k]
        by, bv = v[site - 1], velocity[site - 1]
        ends[0, k], ends[1, k] = v[0], v[n - 1]


@inline_function
def _interpolate_cubic(
    s: float, dt: float, x0: float, v0: float, x1: float, v1: float
) -> tuple[float, float]:
    """Return place and velocity on the way from one to another, at a fraction s of the time dt."""
    r = 1.0 - s
    rise = x1 - x0
    place = r * r * (x0 + s * (2.0 * x0 + v0 * dt)) + s * s * (x1 + r * (2.0 * x1 - v1 * dt))
    velocity = 6.0 * s * r * rise / dt + r * (r - 2.0 * s) * v0 + s * (s - 2.0 * r) * v1
    return place, velocity
