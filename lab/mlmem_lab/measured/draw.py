# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The figures: speeds with bands, and fronts; each says which data its model has seen."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..studies import style
from .fits import rest
from .runs import AUTHORS, CASES, RAILS, SILENT, SPACINGS, Case, runs
from .study import Study
from .wave import FIRST, LAST, launch, shell

CREDIT = 'Measured: Nadkarni et al., Phys. Rev. Lett. 116, 244501 (2016), CC BY 4.0'
ORDER = (style.S2, style.MARK, '#009e73', '#cc79a7')
"""Colours of the four tracked elements."""


def draw_all(study: Study, folder: Path) -> list[Path]:
    """Draw both figures; return their files.

    Raises:
        OSError: One cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    with style.styled():
        return [
            *style.save_figure(draw_speeds(study), folder / 'measured_speeds'),
            *style.save_figure(draw_fronts(study), folder / 'measured_fronts'),
        ]


def draw_speeds(study: Study) -> Any:
    """Return the figure of all speeds against the spacing, a panel per rail."""
    figure = style.new_figure(3.4)
    for axes, rail in zip(style.axes_grid(figure, 1, 3, sharey=True)[0], RAILS, strict=True):
        cases = [Case(rail, spacing) for spacing in SPACINGS]
        axes.plot(
            SPACINGS,
            [AUTHORS[c] for c in cases],
            's',
            color=style.FAINT,
            ms=5,
            label="authors' simulation",
        )
        axes.plot(
            SPACINGS,
            [study.viscous.speed(c) for c in cases],
            ':',
            color=style.FAINT,
            label='damping alone, fitted at 6 cm',
        )
        for case in cases:
            _speed(axes, study, case)
        axes.set_title(f'rails {rail:g} cm apart')
        axes.set_xlabel('spacing (cm)')
        axes.set_xticks(SPACINGS)
        axes.set_xlim(5.6, 8.4)
        axes.set_ylim(0.0, 4.0)
    figure.axes[0].set_ylabel('speed (m/s)')
    handles, labels = figure.axes[2].get_legend_handles_labels()
    by_label = dict(zip(labels, handles, strict=True))
    figure.legend(
        by_label.values(), by_label.keys(), loc='outside lower center', ncols=3, title=CREDIT
    )
    return figure


def _speed(axes: Any, study: Study, case: Case) -> None:
    x, fitted = case.spacing, case in study.steady.fitted
    if (band := study.bands.get(case)) is not None:
        axes.plot(
            [x, x],
            [band.low, min(band.high, 9.0)],
            color=style.S2,
            lw=6,
            alpha=0.25,
            label='nine of ten random chains',
        )
    axes.plot(
        x, study.steady.speed(case), 'D' if fitted else 'o', ms=7,
        mfc=style.S2 if fitted else 'white', mec=style.S2,
        label='ours, fitted to this' if fitted else 'ours, predicted',
    )  # fmt: skip
    if case in SILENT:
        axes.plot(x, 0.08, 'x', color=style.S1, ms=8, label='measured: no wave')
    for run in runs(case):
        axes.plot(x + 0.12, run.speed, '_', color=style.S1, ms=10, mew=2, label='measured')


def draw_fronts(study: Study) -> Any:
    """Return the figure of the measured fronts with ours, a panel per lattice that propagates."""
    figure = style.new_figure(7.0)
    grid = style.axes_grid(figure, 3, 3, sharex=True)
    for axes, case in zip(grid.T.ravel(), sorted(CASES), strict=True):
        if case in SILENT:
            axes.axis('off')
            axes.text(0.5, 0.5, f'{case}: no wave', ha='center', transform=axes.transAxes)
            continue
        for run in runs(case):
            for u, colour in zip(run.u, ORDER, strict=True):
                axes.plot(run.t - run.arrivals.mean(), u, color=colour, lw=0.8)
        wave = launch(
            case, shell(study.steady.well(case)), study.steady.losses[case.rail], last=LAST + 6
        )
        if np.isfinite(wave.speed):
            for j in range(FIRST, LAST + 1):
                axes.plot(
                    wave.t - wave.arrivals.mean(), wave.u[:, j], '--', color=style.INK, lw=0.8
                )
        told = 'fitted' if case in study.steady.fitted else 'predicted'
        axes.set_title(f'{case}: speed {told}')
        axes.set_ylim(-0.4, 1.15 * rest(case).max())
        axes.set_xlim(-130.0, 150.0)
    for axes in grid[:, 0]:
        axes.set_ylabel('displacement (cm)')
    for axes in grid[-1]:
        axes.set_xlabel('time (ms)')
    figure.supxlabel(f'Dashed: ours. {CREDIT}', fontsize=style.SMALL - 2, color=style.INK)
    return figure
