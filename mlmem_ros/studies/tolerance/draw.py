# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The picture of a tolerance study: error against scatter, and by level."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from ..campaign import Row
from ..style import COMPRESSION, FAINT, INK, MARK, TENSION, axes_grid, label, new_figure
from .estimate import RARE, Rate, fit, foot
from .study import Tolerance
from .trial import wanted

COLOURS = {'step': INK, 'left': COMPRESSION, 'right': TENSION}

WORDS = {'step': 'step up', 'left': 'read from the left', 'right': 'read from the right'}

NAMES = {
    'alpha': r'on-site amplification $\alpha_j$, relative',
    's': 'substrate stiffness $s_j$, relative',
    'mass': 'mass $m_j$, relative',
    'offset': 'ground states, in lattice constants',
    'noise': 'noise of the transducers, in cells',
    'vibration': 'vibration of the base, per time unit$^2$',
}

SHOWN = 0.1
"""The rate of the most frequent failure at whose scatter the levels are compared."""


def draw(study: Tolerance, rows: Sequence[Row]) -> Figure:
    """Return the figure: one column for every kind; above by scatter, below by level."""
    figure = new_figure(2.7 * len(study.kinds), 5.2)
    grid = axes_grid(figure, 2, len(study.kinds), sharey='row')
    for column, kind in enumerate(study.kinds):
        _curves(grid[0, column], study, rows, kind)
        label(grid[0, column], 'abcdefgh'[column])
        _levels(grid[1, column], study, rows, kind)
    grid[0, 0].set_ylabel('error rate')
    grid[1, 0].set_ylabel('error rate')
    grid[0, 0].legend(loc='upper left')
    return figure


def _curves(axes: Any, study: Tolerance, rows: Sequence[Row], kind: str) -> None:
    """Draw rates over the scatter, with their intervals and the curve through their foot."""
    axes.axhline(RARE, color=MARK, linewidth=0.8, linestyle=':')
    for failure in FAILURES:
        amounts, rates = study.curve(rows, kind, failure)
        colour = COLOURS[failure]
        _bars(axes, amounts, rates, colour, WORDS[failure])
        if (curve := fit(amounts, rates)) is not None:
            fine = np.geomspace(amounts[0] / 2.0, amounts[foot(rates) - 1], 200)
            axes.plot(fine, curve.rate(fine), color=colour, linewidth=0.8)
            axes.plot([curve.sigma(RARE)], [RARE], 'v', color=colour, markersize=4)
    axes.set(xscale='log', yscale='log', ylim=(2e-4, 1.3), xlabel=NAMES[kind])


def _levels(axes: Any, study: Tolerance, rows: Sequence[Row], kind: str) -> None:
    """Draw rates by level at the scatter where the most frequent failure is next to `SHOWN`."""
    curves = {failure: study.curve(rows, kind, failure) for failure in FAILURES}
    amounts = curves['step'][0]
    most = np.max([[rate.value for rate in rates] for _, rates in curves.values()], axis=0)
    chosen = amounts[int(np.argmin(np.abs(np.log(np.maximum(most, 1e-6) / SHOWN))))]
    some = [row for row in rows if row['kind'] == kind and row['scatter'] == chosen]
    levels = study.design.levels
    for shift, failure in zip((-0.15, 0.0, 0.15), FAILURES, strict=True):
        count = levels - (failure == 'step')
        rates = [study.rate(some, failure, level) for level in range(count)]
        _bars(axes, np.arange(count) + shift, rates, COLOURS[failure], '')
    axes.set_title(f'at {chosen:g}', color=INK, loc='right')
    axes.set(ylim=(0.0, 1.0), xlabel='level (of a step: where it begins)')
    axes.grid(axis='y', color=FAINT, linewidth=0.3)


def _bars(axes: Any, x: Any, rates: Sequence[Rate], colour: str, text: str) -> None:
    """Draw rates with their intervals; where none has failed only the upper end is drawn."""
    for place, rate in zip(x, rates, strict=True):
        low, high = rate.interval
        axes.plot([place, place], [max(low, 1e-6), high], color=colour, linewidth=0.7, alpha=0.7)
    seen = [(place, rate.value) for place, rate in zip(x, rates, strict=True) if rate.failures]
    axes.plot(
        [place for place, _ in seen], [value for _, value in seen], 'o', color=colour,
        markersize=3, label=text or None,
    )  # fmt: skip
