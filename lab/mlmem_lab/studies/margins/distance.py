# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How far an operating point is from failure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mlmem_ros.physics.potential import Array

from ..campaign import Row
from .axes import Axis
from .shmoo import Shmoo


@dataclass(frozen=True)
class Reach:
    """How far one axis can be moved from the operating point with the other fixed.

    Attributes:
        low: Least value from which every point up to the operating value passes.
        high: Greatest such value.
        low_open: Whether the map ends there, so the true value may be beyond.
    """

    axis: Axis
    low: float
    high: float
    low_open: bool
    high_open: bool


@dataclass(frozen=True)
class Margins:
    """The margins of a map's operating point.

    Attributes:
        passed: Whether the operating point itself passes.
        share: Fraction of the points that pass.
        reaches: Along x and along y; none if the operating point fails.
        distance: To the nearest failure in relative change, the root of the sum of the squares
            of (x - x0) / x0 and (y - y0) / y0; None if the map has no failure. An axis whose
            operating value is 0 has no relative change and stays where it is.
        nearest: The row of the nearest failure, or None.
    """

    passed: bool
    share: float
    reaches: tuple[Reach, ...]
    distance: float | None
    nearest: Row | None

    @property
    def nearest_failure(self) -> str:
        """Where the nearest failure is, and how far away, as text."""
        if not self.passed:
            return 'the operating point itself fails'
        if self.nearest is None:
            return 'no failure on the map'
        near = self.nearest
        where = ', '.join(f'{r.axis.name} {near[r.axis.name]:.4g}' for r in self.reaches)
        return f'nearest failure: {where}, {self.distance:.1%} away'

    def as_dict(self) -> dict[str, Any]:
        """Return the margins for a file."""
        return {
            'passed': self.passed,
            'share': self.share,
            'operating': {reach.axis.name: reach.axis.operating for reach in self.reaches},
            'reaches': {
                reach.axis.name: {
                    name: getattr(reach, name) for name in ('low', 'low_open', 'high', 'high_open')
                }
                for reach in self.reaches
            },
            'distance': self.distance,
            'nearest': self.nearest,
        }


def measure(shmoo: Shmoo, rows: Sequence[Row]) -> Margins:
    """Return the margins of a map."""
    passed = shmoo.grid(rows, 'passed').astype(bool)
    row, column = shmoo.operating
    distance = np.hypot(
        _relative(shmoo.x_values, shmoo.x.operating)[None, :],
        _relative(shmoo.y_values, shmoo.y.operating)[:, None],
    )
    distance[passed] = np.inf
    nearest = int(distance.argmin())
    near = float(distance.flat[nearest])
    found = np.isfinite(near)
    reaches = (
        _reach(shmoo.x, shmoo.x_values, passed[row], column),
        _reach(shmoo.y, shmoo.y_values, passed[:, column], row),
    )
    operating = bool(passed[row, column])
    return Margins(
        operating,
        float(passed.mean()),
        reaches if operating else (),
        near if found else None,
        rows[nearest] if found else None,
    )


def _relative(values: Array, operating: float) -> Array:
    if operating == 0.0:
        return np.where(values == 0.0, 0.0, np.inf)
    return (values - operating) / operating


def _reach(axis: Axis, values: Array, passed: NDArray[np.bool_], operating: int) -> Reach:
    fails = np.flatnonzero(~passed)
    below, above = fails[fails < operating], fails[fails > operating]
    low = int(below[-1]) + 1 if len(below) else 0
    high = int(above[0]) - 1 if len(above) else len(values) - 1
    return Reach(axis, float(values[low]), float(values[high]), not len(below), not len(above))
