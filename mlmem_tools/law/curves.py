# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Force-displacement curves of bistable elements: their files, their mean, their scatter.

A file is a CSV with a header that names displacement and force with their units, as
`displacement_mm,force_N`; other columns, and lines that begin with #, are left out. Rows are in
the order in which they were measured. Where the displacement turns back, what follows is the way
back: the law is the mean of both ways, and the area between them the work lost. One file is one
run; several runs, of one specimen or of many, give the mean law and its scatter.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from mlmem import ErrorCode
from mlmem.parsing import DecodeError
from mlmem.physics import DesignError
from mlmem.physics.curve import Curve
from mlmem.physics.values import Array
from mlmem.physics.wall import next_wall_costs

from ..csv_rows import parse_number, read_rows


@dataclass(frozen=True, eq=False)
class MeasuredCurve:
    """One measured curve, in SI units.

    Attributes:
        name: Its file.
        ways: Displacement and force on the way out, and on the way back if there is one, shape
            (2, m) each; both with rising displacements.
    """

    name: str
    ways: Sequence[Array]

    @property
    def range(self) -> tuple[float, float]:
        """First and last displacement that both ways have."""
        return (
            max(float(way[0, 0]) for way in self.ways),
            min(float(way[0, -1]) for way in self.ways),
        )

    def force(self, knots: Array) -> Array:
        """Return the mean force of both ways about each of equally spaced knots."""
        return np.asarray(np.mean([_average_force(way, knots) for way in self.ways], axis=0))

    @property
    def lost(self) -> float | None:
        """Work lost between the two ways, J; None without a way back."""
        if len(self.ways) == 1:
            return None
        knots = np.linspace(*self.range, 512)
        out, back = (np.interp(knots, *way) for way in self.ways)
        return float(np.sum((out - back)[1:] + (out - back)[:-1]) * (knots[1] - knots[0]) / 2.0)


def load_run(path: Path) -> MeasuredCurve:
    """Read a curve.

    Raises:
        DecodeError: It is none; the message names the line.
    """
    (head, names), *rows = list(read_rows(path)) or [(str(path), [''])]
    lengths = {'displacement_um': 1e-6, 'displacement_mm': 1e-3, 'displacement_cm': 1e-2,
               'displacement_m': 1.0}  # fmt: skip
    forces = {'force_mN': 1e-3, 'force_N': 1.0, 'force_kN': 1e3}
    columns = [find_column(head, names, known) for known in (lengths, forces)]
    values = np.array([
        [scale * parse_number(cells[k], place, names[k]) for k, scale in columns]
        for place, cells in rows
    ])  # fmt: skip
    min_rows = 16  # fewest rows of a curve
    if len(values) < min_rows:
        expected = f'at least {min_rows} rows'
        raise DecodeError(ErrorCode.OUT_OF_RANGE, '', len(values), expected, place=str(path))
    D, force = values.T
    turn = int(np.argmax(D))
    out, back = (_sort_rising(D[way], force[way]) for way in (slice(turn + 1), slice(turn, None)))
    if out.shape[1] < min_rows:
        expected = f'a curve whose displacement rises over at least {min_rows} rows'
        raise DecodeError(ErrorCode.OUT_OF_RANGE, '', out.shape[1], expected, place=str(path))
    return MeasuredCurve(str(path), (out, back) if back.shape[1] >= min_rows else (out,))


def find_column(place: str, names: Sequence[str], known: Mapping[str, float]) -> tuple[int, float]:
    """Return the place of the one column whose name is known, and its unit.

    Raises:
        DecodeError: There is none, or there are several.
    """
    found = [(names.index(name), scale) for name, scale in known.items() if name in names]
    if len(found) != 1:
        expected = f'a header that names one of {", ".join(known)}'
        raise DecodeError(ErrorCode.OUT_OF_RANGE, '', ','.join(names), expected, place=place)
    return found[0]


def _sort_rising(D: Array, force: Array) -> Array:
    """Return one way with rising displacements; of equal ones the mean force."""
    places, which = np.unique(D, return_inverse=True)
    return np.array([places, np.bincount(which, force) / np.bincount(which)])


def _average_force(way: Array, knots: Array) -> Array:
    """Return the mean force in the interval about each knot, interpolated where none is in it."""
    D, force = way
    which = np.round((D - knots[0]) / (knots[1] - knots[0])).astype(np.int64)
    inside = (which >= 0) & (which < len(knots))
    number = np.bincount(which[inside], minlength=len(knots))
    at, total = (
        np.bincount(which[inside], each[inside], minlength=len(knots)) for each in (D, force)
    )
    full = number > 0
    return np.interp(knots, at[full] / number[full], total[full] / number[full])


Quantities = Callable[[Curve, int], dict[str, float]]
"""What is told of a ground state, or of the way from it to the next."""


@dataclass(frozen=True, eq=False)
class Measured:
    """The on-site law of some runs.

    Attributes:
        runs: The runs.
        curve: Their mean, in m, N and J.
        each: The curve of every run.
        std: Standard deviation of the force between runs at the curve's knots, N; empty for one.
    """

    runs: Sequence[MeasuredCurve]
    curve: Curve
    each: Sequence[Curve]
    std: Sequence[float]

    @cached_property
    def wells(self) -> list[dict[str, Any]]:
        """Place (m), stiffness (N/m) and energy (J) of every ground state, each with `_std`."""
        return [self._add_spread(_measure_well, n) for n in range(len(self.curve.ground_states))]

    @cached_property
    def barriers(self) -> list[dict[str, Any]]:
        """From every ground state to the next: peak force (N), energies of the barrier and set
        free on passing (J), each with its `_std`; and `depth_std`, the scatter of the energy set
        free relative to the barrier, as in `physics.Scatter`.
        """
        rows = [
            self._add_spread(_measure_barrier, n) for n in range(len(self.curve.ground_states) - 1)
        ]
        for row in rows:
            spread = row['set_free_std']
            row['depth_std'] = None if spread is None else spread / row['barrier']
        return rows

    @property
    def next_walls(self) -> list[dict[str, float]]:
        """For every pair of neighbouring ground states, the energies of the walls to the states
        below and above them over that of their own wall, infinite where there is no such state.
        """
        costs = (next_wall_costs(self.curve, n) for n in range(len(self.barriers)))
        return [{'below': below, 'above': above} for below, above in costs]

    def _add_spread(self, quantities: Quantities, n: int) -> dict[str, Any]:
        found: dict[str, Any] = {**quantities(self.curve, n)}
        alike = len({len(one.ground_states) for one in (self.curve, *self.each)}) == 1
        each = [quantities(one, n) for one in self.each] if alike and len(self.each) > 1 else []
        for name in list(found):
            values = [one[name] for one in each]
            found[f'{name}_std'] = float(np.std(values, ddof=1)) if each else None
        return found

    def as_dict(self) -> dict[str, Any]:
        """Return everything as plain values."""
        return {
            'runs': [
                {'file': run.name, 'ground_states': len(one.ground_states), 'lost': run.lost}
                for run, one in zip(self.runs, self.each, strict=True)
            ],
            'wells': self.wells,
            'barriers': self.barriers,
            'next_walls': self.next_walls,
        }


def _measure_well(curve: Curve, n: int) -> dict[str, float]:
    D = curve.ground_state(n)
    return {
        'displacement': D, 'stiffness': float(curve.stiffness(D)), 'energy': float(curve.energy(D))
    }  # fmt: skip


def _measure_barrier(curve: Curve, n: int) -> dict[str, float]:
    start, top, end = curve.ground_state(n), curve.barrier(n), curve.ground_state(n + 1)
    energy, at_top, beyond = (float(curve.energy(D)) for D in (start, top, end))
    peak = float(curve.slope(np.linspace(start, top, 2_001)).max())
    return {'force': peak, 'barrier': at_top - energy, 'set_free': energy - beyond}


def average_runs(runs: Sequence[MeasuredCurve], knots: int) -> Measured:
    """Return the law of some runs: their mean over the displacements that all have.

    Where it begins pushed, its force above zero, the curve is continued straight to where the
    element is pulled as hard, so that the first ground state is in it.

    Raises:
        DecodeError: They have no displacements in common.
    """
    low = max(run.range[0] for run in runs)
    high = min(run.range[1] for run in runs)
    if not low < high:
        raise DecodeError(reason='the runs have no displacements in common')
    places = np.linspace(low, high, knots)
    forces = np.array([run.force(places) for run in runs])
    mean = forces.mean(axis=0)
    stiffness = mean[1] - mean[0]
    more = 0
    if mean[0] > 0.0 and stiffness > 0.0:
        more = min(knots, math.ceil(2.0 * mean[0] / stiffness) + 1)
    forces = np.hstack((forces[:, :1] + stiffness * np.arange(-more, 0), forces))
    step = (high - low) / (knots - 1)
    try:
        mean_curve, *each = (
            Curve(low - more * step, high, tuple(force.tolist()))
            for force in (forces.mean(axis=0), *forces)
        )
    except DesignError as error:
        place = 'these are no curves of an element'
        raise DecodeError.of_error(error, place=place) from error
    spread = forces.std(axis=0, ddof=1).tolist() if len(runs) > 1 else ()
    return Measured(runs, mean_curve, each, spread)
