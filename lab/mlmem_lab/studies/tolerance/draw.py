# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The picture of a tolerance study: error rates against the amount of each disorder."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.ticker import LogLocator, NullLocator

from ..style import SMALL_FONT_SIZE_PT, Colour, annotate_place, axes_grid, new_figure
from .curve import list_rates
from .element import ALL_KINDS, TRIAL_LABELS, split_kinds
from .estimate import RARE_RATE, Rate, fit_fragility, foot_length


def draw_rates(result: Mapping[str, Any], cases: Sequence[str]) -> Any:
    """Return the figure of some cases of an element: a panel for each thing tried, a curve for
    each kind of disorder.
    """
    kind_colours = dict(zip(ALL_KINDS, (
        Colour.ACTIVE, '#e69f00', Colour.INK, '#56b4e9', Colour.INACTIVE,
        '#d55e00', '#009e73', '#cc79a7', '#999999', '#7f4f24',
    ), strict=True))  # fmt: skip
    curves = {tuple(case.split()[-3:-1]): result['cases'][case]['rows'] for case in cases}
    trials = list(dict.fromkeys(tried for _, tried in curves))
    figure = new_figure(0.6 + 2.8 * len(trials))
    grid = axes_grid(figure, len(trials), sharex=True)[:, 0]
    for axes, tried in zip(grid, trials, strict=True):
        axes.axhline(RARE_RATE, color=Colour.MARK, linewidth=1.2, linestyle=':')
        axes.set(
            xscale='log',
            yscale='log',
            ylim=(2e-4, 2.0),
            ylabel=f'{TRIAL_LABELS[tried]}: error rate',
        )
        axes.xaxis.set_major_locator(LogLocator(numticks=20))
        axes.xaxis.set_minor_locator(NullLocator())
        for (kind, what), rows in curves.items():
            if what == tried:
                colour = kind_colours[split_kinds(kind)[0]]
                draw_curve(axes, *list_rates(rows), colour, kind)
    grid[0].set_title('dotted: one in a thousand fails', fontsize=SMALL_FONT_SIZE_PT)
    grid[-1].set_xlabel(
        'standard deviation: alpha, k_r, s, mass, damping, gain relative;\n'
        'depth over the barrier; offset, noise in cells; vibration per time unit$^2$'
    )
    return figure


def draw_curve(
    axes: Any, amounts: Sequence[float], rates: Sequence[Rate], colour: Any, text: str
) -> None:
    """Draw counts with their intervals, and a name where the curve fitted to them is rare.

    Where none failed the interval stands alone; without a curve the name is at the lowest point.
    """
    # a count without a failure is shown if its interval ends below 1 %
    shown = [i for i, rate in enumerate(rates) if rate.failures or rate.interval[1] < 1e-2]
    for i in shown:
        axes.vlines(amounts[i], *np.maximum(rates[i].interval, 1e-6), color=colour, alpha=0.7)
    seen = [i for i in shown if rates[i].failures]
    axes.plot([amounts[i] for i in seen], [rates[i].value for i in seen], 'o', color=colour,
              markersize=4)  # fmt: skip
    place = (amounts[seen[0]], rates[seen[0]].value) if seen else None
    if (curve := fit_fragility(amounts, rates)) is not None:
        lowest_shown_rate = axes.get_ylim()[0]
        fine = np.geomspace(curve.sigma(lowest_shown_rate), amounts[foot_length(rates) - 1], 200)
        axes.plot(fine, curve.rate(fine), color=colour, linewidth=1.2)
        place = curve.sigma(RARE_RATE), RARE_RATE
        axes.plot(*place, 'v', color=colour, markersize=6)
    if place is not None:
        annotate_place(axes, text, place, (-8, 3), color=colour, ha='right')
