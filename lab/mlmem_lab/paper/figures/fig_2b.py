# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Fig. 2b: where a pinned wall is while the strain grows, s_min before, at, after the defect."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from mlmem import simulate, wall_at
from mlmem.physics import CASE_I, Design
from mlmem_tools.checks.quasistatic import MAX_PINNED_DISTANCE, find_depinning_strain

from ...studies import style
from ...studies.trace import wall_path
from ..figure import Data, Figure, Judged, Quality, judge_numbers

definition = Figure('2b', 'Fig. 2b: position of a pinned wall under growing strain', seconds=5)

SOFTEST_SITES = (81.0, 100.0, 119.0)
"""Sites j_0 of least stiffness: before (Table I), at, and as far after the defect at j = 100."""


@definition.register_data
def compute_data(quality: Quality) -> Data:
    """Return the wall's path under growing strain, by time integration and by equilibria.

    The strain grows linearly; NaN marks a wall that has left through an end.
    """
    duration = quality.pick(20_000.0, 300_000.0)
    max_strain = 0.06  # at the end of the growth, either sign
    data: Data = {'j_0': np.array(SOFTEST_SITES), 'defect': CASE_I.J, 'largest': max_strain}
    for number, j_0 in enumerate(SOFTEST_SITES):
        design = dataclasses.replace(CASE_I, j_0=j_0)
        for name, sign in (('compression', -1.0), ('tension', 1.0)):
            strain, path = _grow_strain(design, sign * max_strain, duration)
            data['strain'] = strain
            data[f'path_{name}_{number}'] = path
            data[f'depin_{name}_{number}'] = _departure_strain(strain, path)
            data[f'static_{name}_{number}'] = abs(
                find_depinning_strain(design, 0, sign, max_strain)
            )
    return data


def _grow_strain(
    design: Design, last_strain: float, duration: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return |strain| and the wall's position while the strain grows slowly to the last one."""
    rate = last_strain / duration
    run = simulate(
        design, initial=wall_at(0), strain=lambda t: rate * t, duration=duration,
        save_every=duration / 480, progress=False,
    )  # fmt: skip
    return abs(rate) * run.t[1:], wall_path(design, run.configuration)[1:] - design.J


def _departure_strain(strain: np.ndarray, path: np.ndarray) -> float:
    """Return the strain at which the wall leaves its defect, NaN if it stays."""
    gone = ~(np.abs(path) < MAX_PINNED_DISTANCE)
    return float(strain[gone.argmax()]) if gone.any() else float('nan')


@definition.register_drawing
def draw_figure(data: Data) -> Any:
    """Draw the three columns of the paper's first row."""
    figure = style.new_figure(3.3)
    grid = style.axes_grid(figure, 1, 3, sharey=True)[0]
    strain, where = 1e3 * data['strain'], ('before', 'at', 'after')
    for number, axes in enumerate(grid):
        axes.axhline(
            data['j_0'][number] - data['defect'], color=style.Colour.MARK, ls='--', zorder=0
        )
        for name, color, below in (
            ('compression', style.Colour.COMPRESSION, 7),
            ('tension', style.Colour.TENSION, -15),
        ):
            path, depin = data[f'path_{name}_{number}'], 1e3 * data[f'static_{name}_{number}']
            axes.plot(strain, path, color=color, lw=2.0, label=name)
            if not np.isnan(data[f'depin_{name}_{number}']):
                axes.plot(depin, 0.0, 'o', color=color, ms=6, zorder=5)
                style.annotate_place(axes, f'{depin:.1f}', (depin, 0.0), (-4, below), ha='right')
            gone = np.flatnonzero(np.isnan(path))
            if len(gone) and gone[0]:
                last = gone[0] - 1
                axes.annotate(
                    '', (strain[gone[0]], np.copysign(99.0, path[last])),
                    (strain[last], path[last]),
                    arrowprops={'arrowstyle': '->', 'color': color, 'lw': 2.0},
                )  # fmt: skip
        axes.set(xlabel=r'$|\varepsilon|$ ($10^{-3}$)', ylim=(-100, 100), xlim=(0, 30))
        style.label_panel(axes, 'b.' + 'i' * (number + 1), rf'$s_{{\min}}$ {where[number]} defect')
    grid[0].set_ylabel('wall $x = X - 100$ (cells)')
    grid[1].legend(loc='lower left')
    return figure


@definition.register_claim(
    'The pinned wall de-pins, and is re-pinned at the strain-induced minimum or leaves (s_min '
    'before the defect)',
    page=4,
    where='Fig. 2b.i',
    how='time integration with slowly growing strain; Newton continuation of the equilibrium',
)
def _row_i(data: Data) -> Judged:
    return _column(data, 0, re_pinned=-19.0, leaves='right')


@definition.register_claim(
    'With s_min at the defect, de-pinning needs a significantly higher strain',
    page=4,
    where='Fig. 2b.ii',
    how='as 2b.i',
)
def _row_ii(data: Data) -> Judged:
    here = float(data['static_compression_1'])
    others = [
        float(data[f'static_{kind}_{n}']) for n in (0, 2) for kind in ('compression', 'tension')
    ]
    stays = bool(np.isnan(data['static_tension_1']))
    ratio = here / max(others)
    return judge_numbers(
        ratio > 1.5 and stays,
        f'compression of {1e3 * here:.2f}e-3, {ratio:.2f} to {here / min(others):.2f} times the '
        f'other four; under tension the minimum is on the defect, and the wall stays up to '
        f'{1e3 * float(data["largest"]):.0f}e-3',
    )


@definition.register_claim(
    'With s_min after the defect, the directions of de-pinning are exchanged',
    page=4,
    where='Fig. 2b.iii',
    how='as 2b.i',
)
def _row_iii(data: Data) -> Judged:
    return _column(data, 2, re_pinned=19.0, leaves='left')


def _column(data: Data, number: int, re_pinned: float, leaves: str) -> Judged:
    squeezed, pulled = (data[f'path_{kind}_{number}'] for kind in ('compression', 'tension'))
    gone = np.flatnonzero(np.isnan(squeezed))
    side = 'none' if not len(gone) else 'right' if squeezed[gone[0] - 1] > 0.0 else 'left'
    end = float(np.mean(pulled[-20:]))
    c, t = (1e3 * float(data[f'static_{kind}_{number}']) for kind in ('compression', 'tension'))
    c_run, t_run = (
        1e3 * float(data[f'depin_{kind}_{number}']) for kind in ('compression', 'tension')
    )
    return judge_numbers(
        side == leaves and abs(end - re_pinned) < 1.0,
        f'compression of {c:.2f}e-3 drives it out at the {side} end; tension of {t:.2f}e-3 '
        f'takes it to x = {end:.1f}, where it is pinned again (time integration: {c_run:.2f}e-3 '
        f'and {t_run:.2f}e-3)',
    )
