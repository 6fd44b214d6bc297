# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The picture of a tolerance study: error against scatter, and by level."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.ticker import FixedLocator, MaxNLocator, NullLocator

from ..campaign import Row
from ..style import FAINT, INK, MARK, S1, S2, WIDTH, axes_grid, label, new_figure
from .estimate import RARE, Rate, fit, foot
from .study import Tolerance

COLOURS = {'step': INK, 'left': S2, 'right': S1}

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
"""Levels are compared at the amount whose rate is nearest to this."""

UNSEEN = 1e-2
"""A count without a failure is shown if its interval ends below this."""

TICKS = ((1.0, 2.0, 3.0, 4.0, 6.0, 8.0), (1.0, 2.0, 5.0), (1.0, 3.0), (1.0,))
"""Multiples of powers of ten that may be labelled on an axis, from fine to coarse."""

MOST_TICKS = 4
"""Labels that fit below a panel."""

RANGE = (2e-4, 1.3)
"""Rates that are shown."""


def draw(study: Tolerance, rows: Sequence[Row]) -> Any:
    """Return the figure: one column for every kind; above by scatter, below by level."""
    figure = new_figure(5.8, max(WIDTH, 2.7 * len(study.kinds)))
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
    """Draw rates over the scatter, with their intervals and fitted curves."""
    axes.axhline(RARE, color=MARK, linewidth=1.2, linestyle=':')
    for tried in study.tried:
        amounts, rates = study.rates(rows, kind, tried)
        draw_curve(axes, amounts, rates, COLOURS[tried], WORDS[tried])
    dress(axes, kind)


def dress(axes: Any, kind: str) -> None:
    """Set scales, limits and labels of axes that show rates over the scatter of a kind."""
    axes.set(xscale='log', yscale='log', ylim=RANGE, xlabel=NAMES[kind])
    axes.xaxis.set_major_locator(FixedLocator(_labelled(*axes.get_xlim())))
    axes.xaxis.set_major_formatter(lambda x, _: f'{x:.0e}'.replace('e-0', 'e-'))
    axes.xaxis.set_minor_locator(NullLocator())


def _labelled(low: float, high: float) -> list[float]:
    """Return the amounts to label on an axis: as many as fit."""
    decades = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    for subs in TICKS:
        found = [sub * 10.0**decade for decade in decades for sub in subs]
        found = [amount for amount in found if low <= amount <= high]
        if len(found) <= MOST_TICKS:
            return found
    return found[:: math.ceil(len(found) / MOST_TICKS)]


def draw_curve(
    axes: Any, amounts: Sequence[float], rates: Sequence[Rate], colour: Any, text: str
) -> None:
    """Draw counts with their intervals, the curve fitted to them, and where it is `RARE`."""
    shown = [i for i, rate in enumerate(rates) if rate.failures or rate.interval[1] < UNSEEN]
    draw_rates(axes, [amounts[i] for i in shown], [rates[i] for i in shown], colour, text)
    if (curve := fit(amounts, rates)) is not None:
        fine = np.geomspace(curve.sigma(RANGE[0]), amounts[foot(rates) - 1], 200)
        axes.plot(fine, curve.rate(fine), color=colour, linewidth=1.2)
        axes.plot([curve.sigma(RARE)], [RARE], 'v', color=colour, markersize=6)


def _levels(axes: Any, study: Tolerance, rows: Sequence[Row], kind: str) -> None:
    """Draw rates by level, each at the scatter at which about one in ten fails."""
    chosen = []
    for shift, tried in zip((-0.15, 0.0, 0.15), study.tried, strict=False):
        amounts, rates = study.rates(rows, kind, tried)
        if not any(rate.failures for rate in rates):
            continue
        most = np.array([max(rate.value, 1e-6) for rate in rates])
        number = int(np.argmin(np.abs(np.log(most / SHOWN))))
        some = study.curve(rows, kind, tried)[1][number]
        levels, by_level = zip(*study.rates_by_level(some).items(), strict=True)
        draw_rates(axes, np.array(levels) + shift, by_level, COLOURS[tried], '')
        chosen.append(f'{amounts[number]:.2g}')
    axes.set_title(f'at {", ".join(chosen)}', color=INK, loc='right')
    axes.set(ylim=(0.0, 0.5), xlabel='level (of a step: where it begins)')
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.grid(axis='y', color=FAINT, linewidth=0.3)


def draw_rates(axes: Any, x: Any, rates: Sequence[Rate], colour: Any, text: str) -> None:
    """Draw rates with their intervals; where none failed, the interval alone."""
    low, high = np.array([rate.interval for rate in rates]).reshape(-1, 2).T
    axes.vlines(x, np.maximum(low, 1e-6), high, color=colour, linewidth=1.0, alpha=0.7)
    seen = [(place, rate.value) for place, rate in zip(x, rates, strict=True) if rate.failures]
    axes.plot(*zip(*seen, strict=True) if seen else ([], []), 'o', color=colour, markersize=4,
              label=text or None)  # fmt: skip
