# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How far an operating point is from failure, and the map as a picture: the colour of a point
shows at which level it fails.
"""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.colors import BoundaryNorm, ListedColormap
from numpy.typing import NDArray

from mlmem.physics.potential import Array

from ..campaign import Row
from ..style import FAINT_COLOUR, INACTIVE_COLOUR, INK_COLOUR, PALE_COLOUR, axes_grid, new_figure
from .shmoo import UNFIT_FAILURE, Axis, Shmoo


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


def measure_margins(shmoo: Shmoo, rows: Sequence[Row]) -> Margins:
    """Return the margins of a map."""
    passed = shmoo.build_grid(rows, 'passed').astype(bool)
    row, column = shmoo.operating
    distance = np.hypot(
        _relative_values(shmoo.x_values, shmoo.x.operating)[None, :],
        _relative_values(shmoo.y_values, shmoo.y.operating)[:, None],
    )
    distance[passed] = np.inf
    nearest = int(distance.argmin())
    near = float(distance.flat[nearest])
    found = np.isfinite(near)
    reaches = (
        _measure_reach(shmoo.x, shmoo.x_values, passed[row], column),
        _measure_reach(shmoo.y, shmoo.y_values, passed[:, column], row),
    )
    operating = bool(passed[row, column])
    return Margins(
        operating,
        float(passed.mean()),
        reaches if operating else (),
        near if found else None,
        rows[nearest] if found else None,
    )


def _relative_values(values: Array, operating: float) -> Array:
    if operating == 0.0:
        return np.where(values == 0.0, 0.0, np.inf)
    return (values - operating) / operating


def _measure_reach(axis: Axis, values: Array, passed: NDArray[np.bool_], operating: int) -> Reach:
    fails = np.flatnonzero(~passed)
    below, above = fails[fails < operating], fails[fails > operating]
    low = int(below[-1]) + 1 if len(below) else 0
    high = int(above[0]) - 1 if len(above) else len(values) - 1
    return Reach(axis, float(values[low]), float(values[high]), not len(below), not len(above))


LONGEST_LINE = 50
"""Characters of an axis label that fit along the map."""

FAILURE_SIGNS = {
    'echo': ('o', INK_COLOUR, 'right wall, wrong echo'),
    'silent': ('x', INACTIVE_COLOUR, 'right echo, wrong wall'),
    UNFIT_FAILURE: ('', FAINT_COLOUR, 'invalid settings'),
}
"""Marker, colour and label of the failures that are not the wall's."""


def draw_map(shmoo: Shmoo, rows: Sequence[Row], margins: Margins) -> Any:
    """Draw a map."""
    figure = new_figure(5.2)
    axes = axes_grid(figure)[0, 0]
    x, y = _drawn_places(shmoo.x, shmoo.x_values), _drawn_places(shmoo.y, shmoo.y_values)
    axes.set_xscale('log' if shmoo.x.log else 'linear')
    axes.set_yscale('log' if shmoo.y.log else 'linear')
    _draw_cells(figure, axes, shmoo, rows, x, y)
    _draw_signs(axes, shmoo, rows, x, y)
    _draw_distance(axes, shmoo, margins)
    row, column = shmoo.operating
    axes.plot(
        x[column],
        y[row],
        '*',
        color='w',
        mec=INK_COLOUR,
        ms=14.0,
        clip_on=False,
        label='operating point',
    )
    x_edges, y_edges = _cell_edges(x, shmoo.x.log), _cell_edges(y, shmoo.y.log)
    axes.set(
        xlabel=_axis_label(shmoo.x), ylabel=_axis_label(shmoo.y),
        xlim=(x_edges[0], x_edges[-1]), ylim=(y_edges[0], y_edges[-1]),
    )  # fmt: skip
    axes.set_title(f'{margins.share:.1%} of {len(rows)} points pass\n{margins.nearest_failure}')
    figure.legend(loc='outside lower left', ncols=2)
    return figure


def _draw_cells(
    figure: Any, axes: Any, shmoo: Shmoo, rows: Sequence[Row], x: Array, y: Array
) -> None:
    levels = shmoo.design.levels
    reached = shmoo.build_grid(rows, 'reached')
    reached[shmoo.build_grid(rows, 'failure') == UNFIT_FAILURE] = -1
    failing = mpl.colormaps['viridis'](np.linspace(0.0, 0.95, levels))
    colors = ListedColormap([FAINT_COLOUR, *failing, PALE_COLOUR])
    mesh = axes.pcolormesh(
        _cell_edges(x, shmoo.x.log), _cell_edges(y, shmoo.y.log), reached, cmap=colors,
        norm=BoundaryNorm(np.arange(-1.5, levels + 1.0), levels + 2), rasterized=True,
    )  # fmt: skip
    every = max(1, levels // 8)
    ticks = [*range(0, levels, every), levels]
    bar = figure.colorbar(mesh, ax=axes, ticks=ticks, pad=0.01)
    bar.ax.set_yticklabels([*(f'fails at level {level}' for level in ticks[:-1]), 'passes'])
    bar.ax.tick_params(length=0)
    bar.ax.set_ylim(-0.5, levels + 0.5)


def _draw_signs(axes: Any, shmoo: Shmoo, rows: Sequence[Row], x: Array, y: Array) -> None:
    failure = shmoo.build_grid(rows, 'failure')
    for kind, (sign, color, words) in FAILURE_SIGNS.items():
        row, column = np.nonzero(failure == kind)
        if len(row) and sign:
            edge = 'w' if sign == 'o' else color  # seen on dark cells, too
            axes.plot(x[column], y[row], sign, color=color, mec=edge, ms=4.0, mew=0.8, label=words)
        elif len(row):
            axes.fill([], [], color=color, label=words)


def _draw_distance(axes: Any, shmoo: Shmoo, margins: Margins) -> None:
    """Draw the line to the nearest failure, and the contour of points as far away."""
    if margins.nearest is None or margins.distance is None or not margins.passed:
        return
    x_0, y_0 = shmoo.x.operating, shmoo.y.operating
    near = margins.nearest[shmoo.x.name], margins.nearest[shmoo.y.name]
    axes.plot([x_0, near[0]], [y_0, near[1]], color=INK_COLOUR, label='nearest failure')
    angle = np.linspace(0.0, 2.0 * np.pi, 361)
    axes.plot(
        x_0 * (1.0 + margins.distance * np.cos(angle)),
        y_0 * (1.0 + margins.distance * np.sin(angle)),
        color=INK_COLOUR, lw=1.0, ls=':',
    )  # fmt: skip


def _axis_label(axis: Axis) -> str:
    text = f'{axis.name}: {axis.text}' + (f' [{axis.unit}]' if axis.unit else '')
    return '\n'.join(textwrap.wrap(text, LONGEST_LINE))


def _drawn_places(axis: Axis, values: Array) -> Array:
    """Return where to draw values: on a logarithmic axis, zero at the edge of the map."""
    return np.where(values == 0.0, axis.low, values) if axis.log else values


def _cell_edges(places: Array, log: bool) -> Array:
    """Return the borders of cells around places, shape (n + 1,)."""
    p = np.log(places) if log else places
    middle = 0.5 * (p[1:] + p[:-1])
    edges = np.concatenate(([2.0 * p[0] - middle[0]], middle, [2.0 * p[-1] - middle[-1]]))
    return np.exp(edges) if log else edges
