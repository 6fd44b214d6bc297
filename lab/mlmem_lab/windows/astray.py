# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Count kicks that go astray in elements whose parts scatter: paper, nine cells, robust.

On-site stiffnesses, springs and masses scatter at once. A kick from blank goes astray if the wall
does not rest within 1.5 cells of its level, or a quarter of J if that is less. One speed per level
and design: that of its file, which was not chosen on any of these elements. No read verifies it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mlmem import Settings, load_element
from mlmem.physics import Design, Scatter, Specimen, draw_specimen
from mlmem.physics.equilibrium import make_blank
from mlmem_tools.identification.kick_search import build_chain, build_kick, drive_end

from ..study import Study


def find_scattered_ends(
    design: Design,
    settings: Settings,
    scatter: float,
    speeds: Mapping[int, Sequence[float]],
    rest_time: float,
) -> list[list[int]]:
    """Return where kicks from blank leave the wall of elements whose parts scatter, as
    `drive_end`, a row for each element.

    Args:
        design: The design.
        settings: Its settings, which shape the kicks.
        scatter: Relative standard deviation of on-site stiffness, springs and masses.
        speeds: Mean speeds by the seed of the element.
        rest_time: Time after a kick in which the wall comes to rest.
    """
    chain = build_chain(Specimen(design), settings)
    deviations = Scatter(alpha=scatter, k_r=scatter, mass=scatter)
    found = []
    for seed, own in speeds.items():
        chain.set_specimen(draw_specimen(design, deviations, seed))
        ends = []
        for speed in own:
            chain.place(make_blank(chain.specimen))
            ends.append(
                drive_end(chain, build_kick(chain, float(speed), settings.kick), rest_time)
            )
        found.append(ends)
    return found


def count_astray(
    design: Design, settings: Settings, scatter: float, elements: int = 40, seed: int = 4000
) -> dict[str, int]:
    """Return how many kicks of scattered elements there were, and how many went astray.

    `squares` is the sum of the square of the number of an element's failures. Every element has
    a kick to every level.
    """
    speeds = dict.fromkeys(range(seed, seed + elements), settings.kick.wall_speeds)
    rest = max(5.0 / design.eta, settings.kick.settle)  # at least five damping times
    ends = np.array(find_scattered_ends(design, settings, scatter, speeds, rest))
    missed = (ends != np.arange(design.levels)).sum(axis=1)
    return {'kicks': ends.size, 'astray': int(missed.sum()), 'squares': int((missed**2).sum())}


def measure_preset(name: str, seed: int) -> dict[str, Any]:
    """Return the counts of a shipped element by scatter."""
    found: dict[str, Any] = {}
    for scatter in (0.001, 0.003, 0.01, 0.02, 0.03, 0.05, 0.08):
        found[f'{scatter:g}'] = row = count_astray(
            *load_element(name).design_and_settings, scatter, seed=seed
        )
        if row['astray'] > 0.5 * row['kicks']:  # no greater scatter is counted
            break
    return found


def draw_shares(result: Mapping[str, Any]) -> Any:
    """Draw the share of kicks astray over the scatter, with intervals; open where none did."""
    # the search of a design counts, and neither draws nor pools
    from ..studies import style
    from ..studies.tolerance.estimate import pool_failures

    figure = style.new_figure(3.4)
    axes = style.axes_grid(figure)[0, 0]
    colours = style.Colour.INACTIVE, style.Colour.MARK, style.Colour.TENSION, style.Colour.ACTIVE
    element_count, min_shown_share = 40, 1e-3  # the share is the lower edge
    labels = {
        'case_2': "the paper's cells, 8 levels",
        'kick_2': 'nine cells, 4 levels',
        'robust_2': 'robust, 4 levels',
        'robust_3': 'robust, 8 levels',
    }
    for (name, label), colour, mark in zip(labels.items(), colours, 'os^v', strict=True):
        rows = result['cases'][name]
        scatters = np.array([float(scatter) for scatter in rows])
        rates = [
            pool_failures(element_count, row['kicks'] // element_count, row['astray'],
                row['squares'])
            for row in rows.values()
        ]  # fmt: skip
        ends = np.array([rate.interval for rate in rates])
        shares = np.array([rate.value or math.nan for rate in rates])
        seen = shares > 0.0
        axes.vlines(scatters[seen], *ends[seen].T, color=colour, alpha=0.5)
        axes.plot(scatters, shares, mark + '-', color=colour, markersize=5, label=label)
        # where none went astray, at the lower edge
        edge = np.full(len(scatters), min_shown_share)
        axes.plot(
            scatters[~seen], edge[~seen], mark, color=colour, markersize=5, fillstyle='none',
            clip_on=False,
        )  # fmt: skip
    axes.set(
        xscale='log', yscale='log', ylim=(min_shown_share, 1.1),
        ylabel='share of kicks that go astray',
        xlabel='scatter of on-site stiffness, springs and masses at once',
    )  # fmt: skip
    axes.axvspan(0.01, 0.05, color=style.Colour.FAINT, alpha=0.25, linewidth=0)
    axes.text(0.0105, 0.0013, 'printed or machined parts', fontsize=style.SMALL_FONT_SIZE_PT)
    figure.legend(loc='outside upper center', ncols=4)
    return figure


astray_study = Study(
    'astray',
    measure_preset,
    ('case_2', 'kick_2', 'robust_2', 'robust_3'),
    (
        'lab/mlmem_lab/windows/astray.py',
        'lab/mlmem_lab/studies/tolerance/estimate.py',
        'mlmem_tools/identification/kick_search.py',
    ),
    4000,
    draw=draw_shares,
)
