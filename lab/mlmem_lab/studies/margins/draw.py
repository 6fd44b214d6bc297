# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A map as a picture: the colour of a point shows at which level it fails."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.colors import BoundaryNorm, ListedColormap

from mlmem_ros.physics.potential import Array

from ..campaign import Row
from ..style import FAINT, INK, PALE, S1, axes_grid, new_figure
from .axes import Axis
from .distance import Margins
from .shmoo import UNFIT, Shmoo

LONGEST_LINE = 50
"""Characters of an axis label that fit along the map."""

SIGNS = {
    'echo': ('o', INK, 'right wall, wrong echo'),
    'silent': ('x', S1, 'right echo, wrong wall'),
    UNFIT: ('', FAINT, 'invalid settings'),
}
"""Marker, colour and label of the failures that are not the wall's."""


def draw(shmoo: Shmoo, rows: Sequence[Row], margins: Margins) -> Any:
    """Draw a map."""
    figure = new_figure(5.2)
    axes = axes_grid(figure)[0, 0]
    x, y = _places(shmoo.x, shmoo.x_values), _places(shmoo.y, shmoo.y_values)
    axes.set_xscale('log' if shmoo.x.log else 'linear')
    axes.set_yscale('log' if shmoo.y.log else 'linear')
    _draw_cells(figure, axes, shmoo, rows, x, y)
    _draw_signs(axes, shmoo, rows, x, y)
    _draw_distance(axes, shmoo, margins)
    row, column = shmoo.operating
    axes.plot(
        x[column], y[row], '*', color='w', mec=INK, ms=14.0, clip_on=False, label='operating point'
    )
    x_edges, y_edges = _edges(x, shmoo.x.log), _edges(y, shmoo.y.log)
    axes.set(
        xlabel=_label(shmoo.x), ylabel=_label(shmoo.y),
        xlim=(x_edges[0], x_edges[-1]), ylim=(y_edges[0], y_edges[-1]),
    )  # fmt: skip
    axes.set_title(f'{margins.share:.1%} of {len(rows)} points pass\n{margins.nearest_failure}')
    figure.legend(loc='outside lower left', ncols=2)
    return figure


def _draw_cells(
    figure: Any, axes: Any, shmoo: Shmoo, rows: Sequence[Row], x: Array, y: Array
) -> None:
    levels = shmoo.design.levels
    reached = shmoo.grid(rows, 'reached')
    reached[shmoo.grid(rows, 'failure') == UNFIT] = -1
    failing = mpl.colormaps['viridis'](np.linspace(0.0, 0.95, levels))
    colors = ListedColormap([FAINT, *failing, PALE])
    mesh = axes.pcolormesh(
        _edges(x, shmoo.x.log), _edges(y, shmoo.y.log), reached, cmap=colors,
        norm=BoundaryNorm(np.arange(-1.5, levels + 1.0), levels + 2), rasterized=True,
    )  # fmt: skip
    every = max(1, levels // 8)
    ticks = [*range(0, levels, every), levels]
    bar = figure.colorbar(mesh, ax=axes, ticks=ticks, pad=0.01)
    bar.ax.set_yticklabels([*(f'fails at level {level}' for level in ticks[:-1]), 'passes'])
    bar.ax.tick_params(length=0)
    bar.ax.set_ylim(-0.5, levels + 0.5)


def _draw_signs(axes: Any, shmoo: Shmoo, rows: Sequence[Row], x: Array, y: Array) -> None:
    failure = shmoo.grid(rows, 'failure')
    for kind, (sign, color, words) in SIGNS.items():
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
    axes.plot([x_0, near[0]], [y_0, near[1]], color=INK, label='nearest failure')
    angle = np.linspace(0.0, 2.0 * np.pi, 361)
    axes.plot(
        x_0 * (1.0 + margins.distance * np.cos(angle)),
        y_0 * (1.0 + margins.distance * np.sin(angle)),
        color=INK, lw=1.0, ls=':',
    )  # fmt: skip


def _label(axis: Axis) -> str:
    text = f'{axis.name}: {axis.text}' + (f' [{axis.unit}]' if axis.unit else '')
    return '\n'.join(textwrap.wrap(text, LONGEST_LINE))


def _places(axis: Axis, values: Array) -> Array:
    """Return where to draw values: on a logarithmic axis, zero at the edge of the map."""
    return np.where(values == 0.0, axis.low, values) if axis.log else values


def _edges(places: Array, log: bool) -> Array:
    """Return the borders of cells around places, shape (n + 1,)."""
    p = np.log(places) if log else places
    middle = 0.5 * (p[1:] + p[:-1])
    edges = np.concatenate(([2.0 * p[0] - middle[0]], middle, [2.0 * p[-1] - middle[-1]]))
    return np.exp(edges) if log else edges
