# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A chain of measured elements, and what slows it, from a film of some of them.

The first element is pushed over; the film shows displacements of others as the wave passes. The
unknowns are the rate of a viscous drag, a dry friction, and the time in which the first element
was pushed over. SI units.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from mlmem.physics import HeldCell, substep_times
from mlmem.physics.curve import Curve
from mlmem.physics.methods import NOH_BATHE
from mlmem.physics.potential import Array
from mlmem_tools.law.curves import (
    FORCE_UNITS,
    LENGTH_UNITS,
    CurveError,
    find_column,
    parse_numbers,
    read_table,
)

from ..lattices import Coupling, Friction, Lattice, Linear, OnSite, PowerLaw
from ..measured.runs import first_crossing

DISTANCE_COLUMNS = {
    name.replace('displacement', 'distance'): unit for name, unit in LENGTH_UNITS.items()
}
TIME_COLUMNS = {'t_ms': 1e-3, 't_s': 1.0}
TRACKED_COLUMN = re.compile(r'u(\d+)_(um|mm|cm|m)')
"""The column of an element, counted from the driven one as 1."""

MIN_ROWS = 16
"""Fewest rows of a film or of a coupling."""

RELATIVE_SCATTER = 0.05
"""Error of a displacement, over the way to the second well: elements are not all alike."""

ROWS_PER_DATUM = 20.0
"""Rows of a front that count as one datum."""

STEP, LOOKS, AHEAD = 0.02, 10, 64
"""Step over the period of the stiffest waves, steps between two looks, and looks whose push is
computed at once."""

MAX_WAVE_PERIODS = 60.0
"""When a wave is given up, in the hand's time and the slowest period."""


@dataclass(frozen=True, eq=False)
class Film:
    """Tracked displacements.

    Attributes:
        t: Times, s, shape (m,).
        u: Displacements, m, shape (k, m).
        sites: Numbers of the k elements, the driven one being 1.
    """

    t: Array
    u: Array
    sites: tuple[int, ...]


def load_film(path: Path) -> Film:
    """Read a film: columns t_ms or t_s, and u8_mm, u9_mm ... for the elements 8, 9 ...

    Raises:
        CurveError: It is none; the message names the line.
    """
    line, names, rows = read_table(path, 't_ms,u8_mm,u9_mm')
    time, unit = find_column(path, line, names, TIME_COLUMNS)
    of = [(k, found) for k, name in enumerate(names) if (found := TRACKED_COLUMN.fullmatch(name))]
    if not of:
        raise CurveError(
            f'{path}, line {line}: the header must name tracked elements as u8_mm, 8 being the '
            'number of the element, the driven one 1'
        )
    values = np.array(
        [parse_numbers(path, k, text, names, (time, *(c for c, _ in of))) for k, text in rows]
    )
    if len(values) < MIN_ROWS:
        raise CurveError(f'{path}: it must have at least {MIN_ROWS} rows; got {len(values)}')
    t = unit * values[:, 0]
    if (late := np.flatnonzero(np.diff(t) <= 0.0)).size:
        raise CurveError(f'{path}, line {rows[late[0] + 1][0]}: times must rise')
    units = np.array([LENGTH_UNITS[f'displacement_{found[2]}'] for _, found in of])
    return Film(t, units[:, None] * values[:, 1:].T, tuple(int(found[1]) for _, found in of))


@dataclass(frozen=True)
class Magnets:
    """A repulsion A (r + b)^-p at a distance r.

    Attributes:
        A, b, p: In m and N.
        error: Largest relative error over what was measured.
    """

    A: float
    b: float
    p: float
    error: float


def load_coupling(path: Path) -> Magnets:
    """Read the repulsion of two elements over their distance, as distance_mm,force_N, and fit it.

    Raises:
        CurveError: It is none; the message names the line.
    """
    line, names, rows = read_table(path, 'distance_mm,force_N')
    (r, length), (f, unit) = (
        find_column(path, line, names, known) for known in (DISTANCE_COLUMNS, FORCE_UNITS)
    )
    values = np.array([parse_numbers(path, k, text, names, (r, f)) for k, text in rows])
    if len(values) < MIN_ROWS:
        raise CurveError(f'{path}: it must have at least {MIN_ROWS} rows; got {len(values)}')
    if (bad := np.flatnonzero((values <= 0.0).any(axis=1))).size:
        raise CurveError(f'{path}, line {rows[bad[0]][0]}: distance and force must be above 0')
    r, f = values.T * [[length], [unit]]
    middle = float(np.exp(np.log(r).mean()))

    def coupling_misfit(x: Array) -> Array:
        return np.asarray(x[0] - x[2] * np.log((r / middle + x[1]) / (1.0 + x[1])) - np.log(f))

    found = least_squares(
        coupling_misfit, [np.log(f).mean(), 0.1, 3.0], bounds=([-99, 0, 0.1], [99, 9, 30])
    )
    A, b, p = found.x
    return Magnets(
        float(np.exp(A) * (middle * (1.0 + b)) ** p), float(b * middle), float(p),
        float(np.abs(np.expm1(coupling_misfit(found.x))).max()),
    )  # fmt: skip


class Measured(OnSite):
    """A curve of force as the law of a cell."""

    def __init__(self, curve: Curve, unit: float) -> None:
        """Take a curve in m and N, and the unit of force."""
        self.curve, self.unit, self.origin = curve, unit, curve.origin

    def energy(self, x: Array) -> Array:  # type: ignore[override]
        """Return the energy over the unit of force."""
        return np.asarray(self.curve.energy(x) / self.unit)

    def slope(self, x: Array) -> Array:  # type: ignore[override]
        """Return the force over its unit."""
        return np.asarray(self.curve.slope(x) / self.unit)

    def constants(self, n: int) -> tuple[object, ...]:
        """Return what the loops take."""
        return self.curve.constants(np.full(n, self.curve.d / self.unit))


@dataclass(frozen=True, eq=False)
class Wave:
    """Displacements of all elements from their blank state, as a wave runs.

    Attributes:
        t: Times, s, shape (m,).
        u: Displacements, m, shape (m, n).
        way: To the second well, m.
    """

    t: Array
    u: Array
    way: float

    def arrivals(self) -> Array:
        """Return when each element has gone half of its way, s, shape (n,); NaN for never."""
        return np.array([first_crossing(self.t, each, 0.5 * self.way) for each in self.u.T])


@dataclass(frozen=True, eq=False)
class Chain:
    """Elements of one law in a row, the last one held, the first one pushed over.

    Attributes:
        law: Force over displacement, m and N, with two or more ground states.
        coupling: Magnets, or the stiffness of springs in N/m.
        spacing: Of neighbours, m.
        mass: Of an element, kg.
        elements: How many.
    """

    law: Curve
    coupling: Magnets | float
    spacing: float
    mass: float
    elements: int

    @property
    def way(self) -> float:
        """From the first ground state to the next, m."""
        return self.law.ground_state(1) - self.law.ground_state(0)

    @property
    def slowest_period(self) -> float:
        """Period of an element alone in its first well, s."""
        k = float(self.law.stiffness(self.law.ground_state(0)))
        return 2.0 * np.pi * float(np.sqrt(self.mass / k))

    def wave(self, damping: float, friction: float, hand: float, until: int) -> Wave:
        """Push the first element over.

        Args:
            damping: Rate of the drag, 1/s.
            friction: Dry friction, N.
            hand: Time of the push, s.
            until: Element, from 1, that ends the run when it is there; or all are at rest.
        """
        n, start, way, slowest = (
            self.elements + 1,
            self.law.ground_state(0),
            self.way,
            self.slowest_period,
        )
        unit = self.coupling if isinstance(self.coupling, float) else 1.0
        if isinstance(self.coupling, Magnets):
            b, p = self.coupling.b, self.coupling.p
            pair: Coupling = PowerLaw(
                self.coupling.A, -p, self.spacing + b, b + 0.05 * self.spacing
            )
            near = max(self.spacing - way, 0.05 * self.spacing) + b
            stiff = self.coupling.A * p * near ** (-p - 1.0)
        else:
            pair, stiff = Linear(), self.coupling
        fastest = float(np.sqrt((self.law.max_stiffness(way) + 4.0 * stiff) / self.mass))
        dt = STEP * 2.0 * np.pi / fastest
        chain = Lattice(
            Measured(self.law, unit), pair, np.full(n, self.mass / unit), dt,
            damping=self.mass / unit * damping,
            friction=Friction(friction / unit, 1e-3 * way / slowest), held=(n,),
        )  # fmt: skip
        chain.place(np.full(n, start))
        u, late = [chain.displacement.copy()], hand + MAX_WAVE_PERIODS * slowest
        held = _drive_chains(start, way, hand, dt)
        while chain.time < late:
            chain.advance(LOOKS, next(held))
            u.append(chain.displacement.copy())
            if u[-1][until - 1] - start > way or (
                chain.time > hand and np.abs(chain.velocity).max() <= 1e-5 * way / slowest
            ):
                break
        return Wave(
            dt * LOOKS * np.arange(len(u), dtype=np.float64), np.array(u)[:, :-1] - start, way
        )


def _drive_chains(start: float, way: float, hand: float, dt: float) -> Iterator[HeldCell]:
    """Yield the motion of the first element between each two looks, of many computed at once."""
    for begun in itertools.count(0, LOOKS * AHEAD):
        x = np.minimum(substep_times(LOOKS * AHEAD, dt, NOH_BATHE, begun) / hand, 1.0)
        place, speed = start + way * x * x * (3.0 - 2.0 * x), way * 6.0 * x * (1.0 - x) / hand
        for motion in np.split(np.array((place, speed)), AHEAD, axis=1):
            yield HeldCell(1, motion)


@dataclass(frozen=True, eq=False)
class Found:
    """What slows a chain.

    Attributes:
        damping, friction, hand: 1/s, N, s.
        deviations: Their standard deviations.
        misfit: Per datum; 1 if fronts differ by `RELATIVE_SCATTER`.
        begin: When the push began in the film's time, s.
        wave: The wave to the end of the chain.
    """

    damping: float
    friction: float
    hand: float
    deviations: tuple[float, float, float]
    misfit: float
    begin: float
    wave: Wave


def fit_chain(
    chain: Chain, film: Film, tell: Callable[[int, float], None] = lambda *_: None
) -> Found:
    """Find damping, friction and hand with which a chain moves as in a film.

    Args:
        chain: The chain.
        film: The film.
        tell: Called after every wave with their number, and the misfit.

    Raises:
        CurveError: The film is none of this chain.
    """
    if max(film.sites) > chain.elements or min(film.sites) < 2:
        raise CurveError(f'tracked elements must be from 2 to {chain.elements}; got {film.sites}')
    half = np.array([first_crossing(film.t, u, 0.5 * chain.way) for u in film.u])
    if not np.isfinite(half).all():
        late = film.sites[int(np.argmin(np.isfinite(half)))]
        raise CurveError(
            f'element {late} must pass half the way, {500.0 * chain.way:.3g} mm, in the film'
        )
    near = np.abs(film.t - half[:, None]) < 1.5 * chain.slowest_period
    weight = near / (RELATIVE_SCATTER * chain.way * np.sqrt(ROWS_PER_DATUM))
    between = np.linspace(chain.law.ground_state(0), chain.law.ground_state(1), 200)
    strongest = float(np.abs(chain.law.slope(between)).max())
    scale = np.array([0.3 / chain.slowest_period, 0.01 * strongest, chain.slowest_period])
    count = 0

    def total_misfit(found: Array) -> float:
        return float((found**2).sum() * ROWS_PER_DATUM / near.sum())

    def simulate_wave(x: Array, until: int) -> tuple[Wave, float]:
        damping, friction, hand = (scale * np.exp(x)).tolist()
        wave = chain.wave(damping, friction, hand, until)
        passes = wave.arrivals()[np.array(film.sites) - 1]
        return wave, float((half - passes).mean())

    def wave_residuals(x: Array) -> Any:
        nonlocal count
        wave, begin = simulate_wave(x, min(max(film.sites) + 1, chain.elements))
        if np.isfinite(begin):
            at = film.t - begin
            rows = [
                np.interp(at, wave.t, wave.u[:, site - 1]) - u
                for site, u in zip(film.sites, film.u, strict=True)
            ]
            found = weight * np.array(rows)
        else:  # the farther the wave comes, the better
            share = np.isfinite(wave.arrivals()).mean()
            found = weight * chain.way * (2.0 - share)
        count += 1
        found = found.ravel()
        tell(count, total_misfit(found))
        return found

    tries = list(itertools.product((-1.5, 0.0, 1.5), (-1.5, 0.5), (-1.0, 0.0)))
    best = min(tries, key=lambda x: float((wave_residuals(np.array(x)) ** 2).sum()))
    found = least_squares(wave_residuals, best, diff_step=3e-3, bounds=(-6.0, 6.0), max_nfev=40)
    covariance = np.linalg.pinv(found.jac.T @ found.jac)
    damping, friction, hand = (values := scale * np.exp(found.x)).tolist()
    wave, begin = simulate_wave(found.x, chain.elements)
    if not np.isfinite(begin):
        raise CurveError('no wave of this law and coupling passes the tracked elements')
    spread = np.sqrt(np.diag(covariance)) * values
    damped, rubbed, pushed = spread.tolist()
    return Found(
        damping, friction, hand, (damped, rubbed, pushed), total_misfit(found.fun), begin, wave
    )
