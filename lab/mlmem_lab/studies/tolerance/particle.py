# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whether a step will fail, with the wall as a particle, in a hundredth of the time of simulation;
and which steps to simulate: those that this forecast sees near failure, and few others.

The N cells are reduced to one coordinate, the position X: the wall held at X with everything else
relaxed (`held_wall`) has the energy U(X, strain), and a moving wall has the profile of a held one.
Then M X'' = -dU/dX - eta M X' + e'' B, where M = sum (dv_j / dX)^2, and e'' B is the inertia of
the cells on a substrate whose strain e changes. Scatter in an element adds to U to first order:
alpha_j and k_r by their relative deviation times the energy of the cell or spring, a shift of the
ground state by minus the slope of the cell's energy. Neglected are waves, the wall's change of
shape, and that a shift also moves the point called X.

Unequal probability sampling (Horvitz and Thompson 1952): a step simulated with probability q
counts 1 / q times. The estimate is unbiased however bad the forecast is; a good one makes it
cheap. The probability depends on how much the element's deviations from its design can be inflated
before the forecast fails. It should go with the root of the failure rate (Neyman 1934); these
values are near that for the paper's element where two in a thousand fail.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mlmem import Settings
from mlmem.instrument.motion import Cycle
from mlmem.move_settings import select_peak
from mlmem.physics import Design, Specimen
from mlmem.physics.held_wall import cut_excerpt, hold_walls
from mlmem.physics.jit import compile_kernel
from mlmem.physics.potential import Array
from mlmem.rng import Stream, make_generator

POINTS_PER_CELL = 8
"""Positions per cell at which the pull is tabulated, as in `quasistatic`."""

STRAIN_COUNT = 5
"""Strains from zero to the peak at which the pull is tabulated."""


@dataclass(frozen=True)
class Track:
    """The forces on a wall between two positions.

    Attributes:
        before: Cells left out before the excerpt of n cells that the wall feels.
        low: First position in sites.
        peak: Strain of the last row of `pull`; the first has none.
        mass: Of the wall, in m.
        pull: -dU/dX by strain and position, as designed, shape (e, m).
        to_alpha: Pull by position for a unit relative deviation of every alpha_j, shape (m, n).
        to_k_r: The same for every spring between them, unstrained and at the peak, shape
            (2, m, n - 1): what is strained as a whole stretches them.
        to_offset: The same as to_alpha for a unit shift of every ground state.
        inertia: Pull by position for a unit second derivative of the strain, shape (m,).
    """

    design: Design
    before: int
    low: float
    peak: float
    mass: float
    pull: Array
    to_alpha: Array
    to_k_r: Array
    to_offset: Array
    inertia: Array

    def deviation_force(self, specimen: Specimen) -> Array:
        """Return what an element's deviations from its design add to the pull, shape (e, m).

        A substrate that deviates shifts its cells under strain, as if their ground states were
        shifted. Masses and damping are taken as designed.
        """
        part = slice(self.before, self.before + self.to_alpha.shape[1])
        alpha = np.asarray(specimen.alpha_factor)[part] - 1.0
        shift = specimen.strain_shape[part] - self.design.strain_shape[part]
        shift = self.design.end_displacement(self.peak) * (shift - shift.mean())
        fixed = self.to_alpha @ alpha + self.to_offset @ specimen.offsets[part]
        unstrained, strained = self.to_k_r @ (specimen.k_r[part.start : part.stop - 1] - 1.0)
        share = np.linspace(0.0, 1.0, len(self.pull))[:, None]
        strain = self.to_offset @ shift + strained - unstrained
        return np.asarray(fixed + unstrained + share * strain)


@dataclass(frozen=True)
class Schedule:
    """A strain cycle at equal intervals.

    Attributes:
        strain: Shape (k,).
        dt: The interval in time units.
    """

    strain: Array
    dt: float

    @cached_property
    def strain_curvature(self) -> Array:
        """Second derivative of the strain, shape (k,)."""
        return np.asarray(np.gradient(np.gradient(self.strain, self.dt), self.dt))


def build_track(design: Design, low: float, high: float, peak: float) -> Track:
    """Return the forces on a wall between two positions under strains up to a peak.

    Raises:
        StateError: A wall cannot be held there.
    """
    part = cut_excerpt(design, low, high)
    X = np.linspace(low, high, 1 + math.ceil((high - low) * POINTS_PER_CELL))
    pull, to_k_r = [], []
    for strain in np.linspace(0.0, peak, STRAIN_COUNT)[::-1]:
        held = hold_walls(Specimen(part.design), X - part.before, strain * part.strain_shape)
        pull.append(-np.gradient(held.energy, X))
        if strain in (0.0, peak):
            to_k_r.append(-np.gradient(0.5 * np.diff(held.v) ** 2, X, axis=0))
    alpha, potential = part.design.alpha, part.design.potential
    moved = np.gradient(held.v, X, axis=0)
    shape = design.end_displacement(1.0) * design.strain_shape[part.before :][: part.design.N]
    return Track(
        design, part.before, low, peak,
        mass=float(np.mean(np.sum(moved**2, axis=1))),
        pull=np.array(pull[::-1]),
        to_alpha=-np.gradient(alpha * potential.energy(held.v), X, axis=0),
        to_k_r=np.array(to_k_r[::-1]),
        to_offset=np.gradient(alpha * potential.slope(held.v), X, axis=0),
        inertia=-moved @ shape,
    )  # fmt: skip


def roll_wall(track: Track, pull: Array, start: float, schedule: Schedule) -> float:
    """Return where a wall is at the end of a strain cycle.

    The pull is the track's own and what scatter adds; strains are between zero and its peak.

    Returns:
        The position; the end of the track, once the wall has left it.
    """
    per_cell, dt = float(POINTS_PER_CELL), schedule.dt
    x = _roll_particle(
        (start - track.low) * per_cell,
        schedule.strain / track.peak,
        schedule.strain_curvature,
        pull,
        track.inertia,
        dt,
        per_cell / track.mass,
        track.design.eta,
    )
    return track.low + float(x) / per_cell


@compile_kernel
def _roll_particle(
    x: float, share: Array, bend: Array, pull: Array, inertia: Array, dt: float,
    mobility: float, eta: float,
) -> float:  # fmt: skip
    """Semi-implicit Euler on the table, bilinear; x in its spacing."""
    rows, columns = pull.shape
    v = 0.0
    for k in range(len(share)):
        i = int(x)
        if x < 0.0 or i > columns - 2:
            break
        p = x - i
        row = min(max(share[k], 0.0), 1.0) * (rows - 1)
        r = min(int(row), rows - 2)
        q = row - r
        force = (1.0 - q) * ((1.0 - p) * pull[r, i] + p * pull[r, i + 1])
        force += q * ((1.0 - p) * pull[r + 1, i] + p * pull[r + 1, i + 1])
        force += bend[k] * ((1.0 - p) * inertia[i] + p * inertia[i + 1])
        v = (v + dt * mobility * force) / (1.0 + eta * dt)
        x += dt * v
    return x


TIME_STEP = 4.0
"""Step of the particle in time units; a wall in its defect takes 100 and more for a swing."""

FORECAST_KINDS = ('alpha', 'k_r', 's', 'offset')
"""Kinds of scatter for which step failures are forecast."""

REST_OFFSET_CELLS = 0.3
"""Where a wall rests, in cells right of its defect."""

MAX_ARRIVAL_ERROR_CELLS = 2.0
"""Distance from a defect in cells within which a wall has arrived; its rest position scatters
too."""


class StepForecast:
    """The write cycles of an instrument on the walls of a design, reduced to particles."""

    def __init__(self, design: Design, settings: Settings) -> None:
        self._design = design
        self._settings = settings
        self._ways: dict[int, tuple[Track, Schedule]] = {}

    def failing(self, specimen: Specimen, level: int, inflations: Sequence[float]) -> float:
        """Return the first inflation of an element's deviations at which a step up fails.

        They are factors on the deviations from the design.

        Returns:
            Infinity if none fails.
        """
        if level not in self._ways:
            self._ways[level] = self._build_step(level)
        way, cycle = self._ways[level]
        extra = way.deviation_force(specimen)
        start, goal = (
            self._design.defect_site(level) + REST_OFFSET_CELLS,
            self._design.defect_site(level + 1),
        )
        for inflation in inflations:
            end = roll_wall(way, way.pull + inflation * extra, start, cycle)
            if not abs(end - goal) < MAX_ARRIVAL_ERROR_CELLS:
                return inflation
        return math.inf

    def _build_step(self, level: int) -> tuple[Track, Schedule]:
        """Return the track of a step up, and the strain of its write, independent of ticks."""
        design, write = self._design, self._settings.write
        strain = select_peak(write, design.is_freed_by_compression(level))
        low, high = (
            design.defect_site(level) - design.J / 2,
            design.defect_site(level + 1) + design.J / 2,
        )
        cycle = Cycle.plan_cycle(write, strain, self._settings.actuator.max_rate)
        times = np.arange(0.0, cycle.duration + write.final_settle, TIME_STEP)
        return build_track(design, low, high, strain), Schedule(cycle.strain(times), TIME_STEP)


SIMULATION_PROBABILITY = {1.0: 1.0, 1.5: 0.7, 2.5: 0.4, 4.0: 0.2, math.inf: 0.03}
"""Probability of simulation, by the first inflation at which the forecast fails."""

MAX_FAILURE_WEIGHT = 1.0 / min(SIMULATION_PROBABILITY.values())
"""Largest weight of one failure."""

DRAWN_PER_SCREENED = 16
"""Elements drawn with a screen for each one without: about the same computing time."""


def draw_weights(
    forecast: StepForecast, specimen: Specimen, levels: Iterable[int], seed: int
) -> Array:
    """Draw the steps of an element to simulate.

    Returns:
        The weight of each step, in the order of levels: 0 if it is not to be simulated.
    """
    inflations = [inflation for inflation in SIMULATION_PROBABILITY if inflation < math.inf]
    q = np.array(
        [SIMULATION_PROBABILITY[forecast.failing(specimen, level, inflations)] for level in levels]
    )
    drawn = make_generator(seed, Stream.SCREEN).random(len(q)) < q
    return np.where(drawn, 1.0 / q, 0.0)
