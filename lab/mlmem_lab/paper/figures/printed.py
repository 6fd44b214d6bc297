# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Every number that the paper prints of its figures, and how far ours is from it."""

from __future__ import annotations

from typing import Any

import numpy as np

from mlmem import MemoryElement, Write
from mlmem.moves.strain_cycle import EraseSettings
from mlmem.physics import CASE_II, Specimen
from mlmem.physics.equilibrium import find_pinned_wall

from ...results import DEVICE_MODULES
from ...studies import style
from ...studies.trace import wall_position
from ..echoes import PAPER_PROBE, PRINTED_PROBE
from ..figure import Data, Figure, Quality
from ..landscapes import MAX_FIT_ERROR
from . import fig_2a, fig_2b, fig_3b, launches

DATA_FILES = ('fig_2a', 'fig_2b', 'fig_3b', 'launches')
"""The figures whose numbers are compared."""

definition = Figure(
    'printed',
    'Every printed number, and how far ours is from it',
    seconds=20,
    modules=(*DEVICE_MODULES, *(f'lab/mlmem_lab/paper/figures/{name}.py' for name in DATA_FILES)),
)

Row = tuple[str, float, float]
"""Quantity with its place in the paper, the printed number, and ours."""


@definition.register_data
def compute_data(quality: Quality) -> Data:
    """Return names, printed numbers and ours: `places` in cells, `others` in other units."""
    data: Data = {}
    landscapes = fig_2a.compute_data(quality)
    launched = launches.compute_data(quality)
    for kind, rows in (
        ('places', [*_list_extrema(landscapes), *_list_pinned(quality), *_list_moved()]),
        ('others', _list_others(landscapes, launched)),
    ):
        names, printed, ours = zip(*rows, strict=True)
        data |= {kind: names, f'{kind}_printed': printed, f'{kind}_ours': ours}
    return data


def _list_extrema(data: Data) -> list[Row]:
    """Return where the wall's energy is least and greatest; x = X - 100."""
    (zero,) = np.flatnonzero(data['strain'] == 0.0)
    site = float(data['j_0']) - style.MIDDLE_SITE
    found = [
        fig_2a.find_well(data, data['held'][zero])[1],
        fig_2a.find_extremum(data, 'held', 0, -1.0),
        fig_2a.find_extremum(data, 'held', -1, 1.0),
    ]
    names = 'well of the defect', 'maximum, compressed', 'minimum, tense'
    return [
        (f'2a: {name}, $x={at:.0f}$', at, place - style.MIDDLE_SITE)
        for name, at, place in zip(names, (0.0, site, site), found, strict=True)
    ]


def _list_pinned(quality: Quality) -> list[Row]:
    """Return where walls are pinned: again under tension, and without strain."""
    grown = fig_2b.compute_data(quality)
    rows: list[Row] = []
    for number, panel in ((0, 'i'), (2, 'iii')):
        at = float(grown['j_0'][number]) - style.MIDDLE_SITE
        place = float(np.mean(grown[f'path_tension_{number}'][-20:]))
        rows.append((f'2b.{panel}: pinned again, $x={at:.0f}$', at, place))
    design = fig_3b.SHORT_DESIGN
    for level, cell in ((1, 51), (3, 101)):
        place = wall_position(design, find_pinned_wall(design, level))
        rows.append((f'3b: wall, $j={cell}$', cell, place))
    return rows


def _list_moved() -> list[Row]:
    """Return where strain cycles take the wall of Case II, and where a driven end puts a kink."""
    element, rows = MemoryElement(CASE_II), list[Row]()
    for level, at in ((0, -75.0), (3, 0.0), (4, 25.0), (7, 100.0)):
        element.perform(Write(level))
        place = wall_position(CASE_II, element.chain.configuration) - style.MIDDLE_SITE
        rows.append((f'4a: level {level}, $x={at:.0f}$', at, place))
    launch = EraseSettings()
    kink = launches.kick_cell(-launch.launch_speed, launch.start_strain, driven=True)
    return [*rows, ('5: kink, $x=-75$', -75.0, kink - style.MIDDLE_SITE)]


def _list_others(landscapes: Data, launched: Data) -> list[Row]:
    """Return what is no place."""
    velocity = abs(float(launched['printed']))
    made = Specimen(CASE_II)
    held = [find_pinned_wall(made, level) for level in range(CASE_II.levels)]
    errors = landscapes['fits'][..., 0].max(), landscapes['kink_e_rms']
    return [
        ('p. 5: pinning sites, 8', 8, len(held)),
        ('5: speed of the end (device), 0.6148', velocity, EraseSettings().launch_speed),
        ('5: speed of a free end, 0.6148', velocity, abs(launches.threshold_velocity(launched))),
        ('p. 5: carrier, 2.4', PRINTED_PROBE.omega_c, PAPER_PROBE.omega_c),
        ('3b: threshold, 7.5e-3', PRINTED_PROBE.v_th, PAPER_PROBE.v_th),
        ('p. 3: fit of $v_0$ and $V_0$, below 1.35e-4', MAX_FIT_ERROR, float(errors[0])),
        ('p. 3: fit of the kink, below 1.35e-4', MAX_FIT_ERROR, float(errors[1])),
    ]


@definition.register_drawing
def draw_figure(data: Data) -> Any:
    """Draw the difference of every place, and the ratio of every other number."""
    figure = style.new_figure(5.6)
    upper, lower = style.axes_grid(
        figure, 2, 1, height_ratios=(len(data['places']), len(data['others']))
    )[:, 0]
    _draw_rows(upper, data['places'], data['places_ours'] - data['places_printed'])
    upper.axvspan(-0.5, 0.5, color=style.Colour.PRINTED, alpha=0.15, lw=0)
    upper.axvline(0.0, color=style.Colour.PRINTED, label=style.Label.PRINTED)
    upper.set(xlim=(-3.0, 3.0), xlabel='ours minus printed (cells)')
    upper.legend(loc='lower right')
    style.label_panel(upper, 'a', 'places, printed as whole cells (shaded)')
    _draw_rows(lower, data['others'], data['others_ours'] / data['others_printed'])
    lower.axvline(1.0, color=style.Colour.PRINTED)
    lower.set(xscale='log', xlim=(5e-3, 2e2), xlabel='ours over printed')
    style.label_panel(lower, 'b', 'other numbers')
    return figure


def _draw_rows(axes: Any, names: Any, values: Any) -> None:
    rows = np.arange(len(names))
    axes.plot(values, rows, 'o', color=style.Colour.ACTIVE, ms=6, zorder=5)
    for row, value in zip(rows, values, strict=True):
        style.annotate_place(
            axes, f'{value:.2g}' if abs(value) >= 5e-3 else '0', (value, row), (8, 0), va='center'
        )
    axes.set_yticks(rows, names)
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.grid(axis='y', color=style.Colour.FAINT, lw=0.4)
