# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Tolerances of several designs side by side, from the ledgers of their studies."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib as mpl

from ...device import Settings
from ...physics import CASE_II, Design
from ..campaign import CampaignError, Row
from ..campaign.ledger import read
from ..style import INK, MARK, WIDTH, axes_grid, label, new_figure
from .draw import RANGE, WORDS, draw_curve, dress
from .element import KINDS, STEP, chance
from .estimate import FOOT, RARE, Rate, fit
from .particle import FORESEEN, StepForecast, forecast_rate
from .study import Tolerance

FORECAST = 5000
"""Steps per rate of the forecast."""

DASHED = {'linestyle': '--', 'linewidth': 1.2}

ELEMENT = 0.1
"""Fraction of elements with a failing step for which the scatter is given."""


@dataclass(frozen=True)
class Counted:
    """A study as recorded in its ledger.

    Attributes:
        name: Of its folder.
        study: Its definition, with the kinds and things tried that were counted.
        rows: Its points.
    """

    name: str
    study: Tolerance
    rows: list[Row]

    def has(self, kind: str, tried: str) -> bool:
        """Return whether this combination was counted."""
        return any((row['kind'], row['tried']) == (kind, tried) for row in self.rows)

    def in_an_element(self, kind: str) -> str:
        """Return the scatter at which `ELEMENT` of all elements have a failing step.

        It is on the fitted curve, or beyond its end interpolated between two counts, in
        logarithms.
        """
        amounts, rates = self.study.rates(self.rows, kind, STEP)
        steps = self.study.design.levels - 1
        share = -math.expm1(math.log1p(-ELEMENT) / steps)  # steps fail independently
        if share < FOOT and (curve := fit(amounts, rates)) is not None:
            return f'{curve.sigma(share):.2g}'
        for number in range(1, len(rates)):
            low, high = rates[number - 1].value, rates[number].value
            if 0.0 < low < share <= high:
                part = math.log(share / low) / math.log(high / low)
                ratio = amounts[number] / amounts[number - 1]
                return f'{amounts[number - 1] * ratio**part:.2g}'
        return ''


def load_counted(folder: Path, tried: Sequence[str] = ()) -> Counted:
    """Read the ledger of a study.

    Args:
        folder: Of the study.
        tried: The things tried to read; all by default.

    Raises:
        CampaignError: It is not the ledger of a tolerance study, or holds no rows.
        OSError: It cannot be read.
    """
    definition, rows = read(folder / 'ledger.jsonl')
    rows = [row for row in rows if not tried or row['tried'] in tried]
    if definition['name'] != 'tolerance' or not rows:
        raise CampaignError(f'{folder} must hold a study of tolerance')
    shared = definition['common']
    kinds = {row['kind'] for row in rows}
    study = Tolerance(
        Design(**shared['design']), Settings.from_dict(shared['settings']),
        tuple(kind for kind in KINDS if kind in kinds),
        tuple(one for one in WORDS if any(row['tried'] == one for row in rows)),
        screen=shared['screen'], levels=shared['levels'],
    )  # fmt: skip
    return Counted(folder.name, study, rows)


def draw(all_counted: Sequence[Counted]) -> Any:
    """Return the figure: a row for each thing tried, a panel for each kind that makes it fail.

    Dashed: the forecast with the wall as a particle, without simulation.
    """
    shown = {
        tried: [kind for kind in KINDS if any(_fails(one, kind, tried) for one in all_counted)]
        for tried in WORDS
    }
    shared = min(2, len(all_counted))  # what only one study has is in its own figure
    shown = {
        tried: kinds
        for tried, kinds in shown.items()
        if kinds and sum(one.has(kinds[0], tried) for one in all_counted) >= shared
    }
    columns = max(len(kinds) for kinds in shown.values())
    figure = new_figure(2.9 * len(shown), max(WIDTH, 2.4 * columns))
    grid = axes_grid(figure, len(shown), columns, sharey=True)
    colours = mpl.colormaps['viridis'].resampled(len(all_counted) + 1)
    letters = iter('abcdefghijklmnopqr')
    for row, (tried, kinds) in zip(grid, shown.items(), strict=True):
        row[0].set_ylabel(f'error rate of a {WORDS[tried]}')
        for axes in row[len(kinds) :]:
            axes.set_axis_off()
        for axes, kind in zip(row, kinds, strict=False):
            axes.axhline(RARE, color=MARK, linewidth=1.2, linestyle=':')
            label(axes, next(letters))
            for number, one in enumerate(all_counted):
                if one.has(kind, tried):
                    amounts, rates = one.study.rates(one.rows, kind, tried)
                    colour = INK if one.study.design == CASE_II else colours(number)
                    draw_curve(axes, amounts, rates, colour, one.name)
                    if tried == STEP and kind in FORESEEN:
                        axes.plot(*_forecast(one, kind, amounts, rates), color=colour, **DASHED)
            dress(axes, kind)
    handles, names = grid[0, 0].get_legend_handles_labels()
    figure.legend(handles, names, loc='outside lower center', ncols=len(names))
    return figure


def _forecast(
    one: Counted, kind: str, amounts: Sequence[float], rates: Sequence[Rate]
) -> tuple[list[float], list[float]]:
    """Return the amounts around which failures begin, and the forecast rates."""
    design = one.study.design
    forecast = StepForecast(design, one.study.settings)
    some = [a for a, rate in zip(amounts, rates, strict=True) if RANGE[0] < rate.value < 0.3]
    found = [forecast_rate(forecast, design, chance(kind, a).scatter, FORECAST) for a in some]
    return some, [rate or math.nan for rate in found]


def _fails(one: Counted, kind: str, tried: str) -> bool:
    return any(rate.failures for rate in one.study.rates(one.rows, kind, tried)[1])


def table(all_counted: Sequence[Counted]) -> list[list[str]]:
    """Return a table of text, headings first: a line for every kind and thing tried."""
    lines = [
        [kind, words, *(one.study.rare(one.rows, kind, tried)[1] for one in all_counted)]
        for tried, words in WORDS.items()
        for kind in KINDS
    ]
    words = f'a step of {ELEMENT:.0%} of the elements'
    lines += [[kind, words, *(one.in_an_element(kind) for one in all_counted)] for kind in KINDS]
    heading = ['chance', 'what fails', *(one.name for one in all_counted)]
    return [heading, *(line for line in lines if any(line[2:]))]
