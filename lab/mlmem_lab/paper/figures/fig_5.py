# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Fig. 5: the memory reset by a kink that is driven to the wall, from every level."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from mlmem import Erase, MemoryElement, Settings, Write
from mlmem.physics import CASE_II, find_level
from mlmem.settings import TimeSettings

from ...studies import style
from ...studies.trace import record_procedures
from ..figure import Data, Figure, Judged, Quality, judge_numbers

definition = Figure('5', 'Fig. 5: erase by a kink, from every level', seconds=4)


@definition.register_data
def compute_data(quality: Quality) -> Data:
    """Write each level and erase it; keep field and strain of the last level's erase.

    Returns:
        Data with t, strain, field of the longest erase, and per level the outcome, the strain
        cycles and the time it took, and what is left in the true configuration.
    """
    levels = quality.pick((0, 2), tuple(range(CASE_II.levels)))
    settings = dataclasses.replace(Settings(), time=TimeSettings(tick=20.0))
    rows = []
    for level in levels:
        element = MemoryElement(CASE_II, settings)
        element.perform(Write(level))
        trace = record_procedures(element, [('', Erase())])
        content = find_level(CASE_II, element.chain.configuration)
        strain = np.array(trace.strain)
        cycles = _count_excursions(strain) - 1  # the first strains the element for the launch
        erased = trace.outcomes[0].success
        rows.append((level, erased, content, cycles))
    table, data = np.array(rows), trace.list_frames()
    return data | {
        't': data['t'] - trace.begins[0],
        'levels': table[:, 0],
        'erased': table[:, 1].astype(bool),
        'left': table[:, 2],
        'cycles': table[:, 3],
    }


def _count_excursions(strain: np.ndarray) -> int:
    """Return how often the strain leaves zero."""
    away = np.abs(strain) > 1e-9
    return int(np.count_nonzero(away[1:] & ~away[:-1]) + away[0])


@definition.register_drawing
def draw_figure(data: Data) -> Any:
    """Draw the erase of the last level as a contour, and the cost of every level."""
    figure = style.new_figure(4.2)
    left, right = figure.subfigures(1, 2, width_ratios=(2.3, 1.0))
    upper, lower = style.draw_driven(left, data['t'] / 1e3, CASE_II, data['field'], data['strain'])
    style.label_panel(upper, 'i', f'a kink erases level {data["levels"][-1]}')
    style.label_panel(lower, 'ii', 'strain')
    axes = style.axes_grid(right)[0, 0]
    colors = [style.Colour.ACTIVE if blank == -1 else style.Colour.FAINT for blank in data['left']]
    axes.bar_label(axes.bar(data['levels'], data['cycles'], color=colors))
    axes.set(xlabel='level erased', ylabel='strain cycles after the launch')
    axes.set_xticks(data['levels'])
    style.label_panel(axes, 'ours', 'all blank after')
    return figure


@definition.register_claim(
    'A kink conveyed across the element returns it to the inactive phase, from any level',
    page=6,
    where='Fig. 5',
    how='the device writes and erases every level; the true configuration is looked at',
)
def _erase(data: Data) -> Judged:
    blank = data['erased'] & (data['left'] == -1)
    cycles = data['cycles']
    return judge_numbers(
        blank.all(),
        f'{int(blank.sum())} of {len(blank)} levels erased, with '
        f'{", ".join(str(c) for c in cycles)} strain cycles after the launch',
    )
