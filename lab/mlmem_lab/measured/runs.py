# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The measured runs: four neighbouring elements as a wave passes them.

Nadkarni, Arrieta, Chong, Kochmann & Daraio, Phys. Rev. Lett. 116, 244501 (2016); their data, under
CC BY 4.0, are in `data`, with a README.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np

from mlmem.physics.values import Array

DATA_FOLDER = Path(__file__).parent / 'data'


class Case(NamedTuple):
    """A lattice: distance of the rails and spacing of the elements, both in cm."""

    rail: float
    spacing: float

    def __str__(self) -> str:
        """Return its name: that of its files, without the run."""
        return f'rail{self.rail:g}_spacing{self.spacing:g}'


ALL_CASES = tuple(
    Case(rail, spacing) for rail in (21.5, 22.0, 22.5) for spacing in (6.0, 7.0, 8.0)
)
SILENT_CASES = (Case(21.5, 7.0), Case(22.0, 7.0))
"""Where no wave was seen to propagate."""


@dataclass(frozen=True)
class MeasuredRun:
    """One wave.

    Attributes:
        t: Times in ms, shape (m,).
        u: Displacements in cm of the four elements, in the order in which it passes, (4, m).
    """

    case: Case
    t: Array
    u: Array

    @cached_property
    def rest_positions(self) -> Array:
        """Where each element comes to rest, in cm, shape (4,)."""
        rest_window_ms = 40.0  # the last part of a run over which rest positions are averaged, ms
        return np.asarray(self.u[:, self.t > self.t[-1] - rest_window_ms].mean(axis=1))

    @cached_property
    def arrival_times(self) -> Array:
        """When each element passes half its way, ms, shape (4,)."""
        pairs = zip(self.u, self.rest_positions, strict=True)
        return np.array([first_crossing(self.t, u, rest / 2.0) for u, rest in pairs])

    @cached_property
    def speed(self) -> float:
        """Mean speed over the four elements, m/s."""
        return mean_speed(self.case, self.arrival_times)

    @cached_property
    def rise_times(self) -> Array:
        """Time each element takes from a tenth to nine tenths of its way, ms, shape (4,)."""
        pairs = zip(self.u, self.rest_positions, strict=True)
        return np.array([rise_time(self.t, u, rest) for u, rest in pairs])


def mean_speed(case: Case, arrivals: Array) -> float:
    """Return the mean speed in m/s of a wave that arrives at neighbours at these times in ms."""
    steps = len(arrivals) - 1
    cm_per_ms = 10.0  # a centimetre per millisecond, in m/s
    return float(cm_per_ms * case.spacing * steps / (arrivals[-1] - arrivals[0]))


def first_crossing(t: Array, u: Array, level: float) -> float:
    """Return when u first reaches a level, interpolated; NaN if it never does."""
    k = int(np.argmax(u >= level))
    if k == 0:
        return float('nan')
    return float(t[k - 1] + (level - u[k - 1]) / (u[k] - u[k - 1]) * (t[k] - t[k - 1]))


def rise_time(t: Array, u: Array, rest: float) -> float:
    """Return the time from a tenth to nine tenths of the way to rest."""
    return first_crossing(t, u, 0.9 * rest) - first_crossing(t, u, 0.1 * rest)


@cache
def load_runs(case: Case) -> tuple[MeasuredRun, ...]:
    """Return the measured runs of a case; none where nothing propagates."""
    files = sorted(DATA_FOLDER.glob(f'{case}_run*.csv'))
    tables = (np.loadtxt(file, delimiter=',', skiprows=1, unpack=True) for file in files)
    return tuple(MeasuredRun(case, t, np.asarray(u) / 10.0) for t, *u in tables)
