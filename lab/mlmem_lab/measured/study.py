# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The predictions of all nine lattices, with bands, beside what was measured, and their figures:
each says which data its model has seen.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from ..studies import style
from .fits import (
    Fit,
    Scatter,
    fit_front,
    fit_steady,
    fit_viscous,
    force_scatter,
    greatest_friction,
    launch_chains,
    measured_rest,
    pattern_probability,
    share_stopped,
    well_scatter,
)
from .runs import (
    ALL_CASES,
    AUTHORS_SPEEDS,
    RAIL_DISTANCES_CM,
    SILENT_CASES,
    SPACINGS_CM,
    Case,
    load_runs,
)
from .wave import FIRST, LAST, build_shell, launch_wave

BAND_QUANTILES = (0.05, 0.95)
"""Quantiles of a band."""


@dataclass(frozen=True)
class Band:
    """What random chains do.

    Attributes:
        low, high: The middle nine tenths of the speeds of those that pass, m/s.
        stops: Share in which the wave stops before the last tracked element.
    """

    low: float
    high: float
    stops: float


@dataclass(frozen=True)
class Study:
    """Everything that `mlmem measured` tells.

    Attributes:
        steady, viscous, front: The fits; `fit_steady` is ours, `fit_front` only in a full study,
            as `left_out`, `friction`, `force` and `stops`.
        left_out: Speed of each case at 8 cm when it is left out of the fit `fit_steady`, m/s.
        friction: Dry friction that just lets a wave pass, 10 N.
        wells: Scatter of the second wells within a chain, relative.
        bands: By case, with that scatter; empty without random chains.
        force: Scatter of a force on each element with which chains are as uneven as the measured
            ones, 10 N; None if not asked for.
        stops: By size of such a force, the share of chains that stop a wave, by case.
        chains, seed: How many random chains a lattice, and the seed of their numbers.
    """

    steady: Fit
    viscous: Fit
    front: Fit | None
    left_out: Mapping[Case, float]
    friction: Mapping[Case, float]
    wells: float
    bands: Mapping[Case, Band]
    force: float | None
    stops: Mapping[float, Mapping[Case, float]]
    chains: int
    seed: int

    @cached_property
    def rows(self) -> list[dict[str, Any]]:
        """A row per case: prediction, band, measurement, and the other models."""
        return [self._row(case) for case in ALL_CASES]

    def _row(self, case: Case) -> dict[str, Any]:
        band = self.bands.get(case)
        return {
            'rail': case.rail,
            'spacing': int(case.spacing),
            'speed': _finite_number(self.steady.speed(case)),
            'fitted': case in self.steady.fitted,
            'low': band and band.low,
            'high': band and band.high,
            'stops': band and band.stops,
            'measured': [run.speed for run in load_runs(case)]
            if case not in SILENT_CASES
            else None,
            'viscous': _finite_number(self.viscous.speed(case)),
            'front': self.front and _finite_number(self.front.speed(case)),
            'authors': AUTHORS_SPEEDS[case],
            'left_out': self.left_out.get(case),
            'friction_limit': self.friction.get(case),
        }

    def as_dict(self) -> dict[str, Any]:
        """Return everything as plain values."""
        return {
            'cases': self.rows,
            'fits': {
                each.name: _summarise_fit(each)
                for each in (self.steady, self.viscous, self.front)
                if each
            },
            'scatter': {'wells': self.wells, 'force': self.force},
            'stops': [
                {'force': force, 'pattern': pattern_probability(by_case), **by_case}
                for force, by_case in self.stops.items()
            ],
            'chains': self.chains,
            'seed': self.seed,
        }


def build_study(chains: int, seed: int, full: bool = False) -> Study:
    """Fit, predict, and launch random chains.

    Args:
        chains: Random chains a lattice; 0 for none, and no bands.
        seed: Of their random numbers.
        full: Whether to fit the fronts, and to find out how probable silence is with a force on
            each element, or with more friction; and leave out each fitted case in turn.
    """
    ours = fit_steady()
    left_out, friction = {}, {}
    if full:
        left_out = {case: fit_steady(left_out=case).speed(case) for case in ours.fitted}
        friction = {case: greatest_friction(case, ours) for case in ALL_CASES}
    wells = well_scatter(ours.fitted)
    generator = np.random.default_rng(seed)
    bands, force, stopping = {}, None, {}
    if chains:
        bands = {
            case: _speed_band(case, ours, Scatter(wells), chains, generator) for case in ALL_CASES
        }
    if chains and full:
        force = force_scatter(ours, ours.fitted, wells, chains, seed)
        for size in (0.0, 0.5 * force, force):
            stopping[size] = {
                case: share_stopped(
                    launch_chains(case, ours, Scatter(wells, size), chains, generator)
                )
                for case in ALL_CASES
            }
    return Study(
        ours,
        fit_viscous(),
        fit_front() if full else None,
        left_out,
        friction,
        wells,
        bands,
        force,
        stopping,
        chains,
        seed,
    )


def _speed_band(
    case: Case, fit: Fit, scatter: Scatter, chains: int, generator: np.random.Generator
) -> Band:
    waves = launch_chains(case, fit, scatter, chains, generator, uncertain=True)
    speeds = [wave.speed for wave in waves if np.isfinite(wave.speed)]
    low, high = np.quantile(speeds, BAND_QUANTILES) if speeds else (np.nan, np.nan)
    return Band(float(low), float(high), share_stopped(waves))


def _summarise_fit(fit: Fit) -> dict[str, Any]:
    return {
        'fitted': [str(case) for case in fit.fitted],
        'losses': {
            rail: {
                'damping': losses.damping,
                'friction': losses.friction,
                'deviations': np.sqrt(np.diag(fit.covariance[rail]))
                if rail in fit.covariance
                else None,
            }
            for rail, losses in fit.losses.items()
        },
        'wells': {str(case): well for case, well in fit.wells.items()},
    }


def _finite_number(value: float) -> float | None:
    return value if np.isfinite(value) else None


DATA_CREDIT = 'Measured: Nadkarni et al., Phys. Rev. Lett. 116, 244501 (2016), CC BY 4.0'
ELEMENT_COLOURS = (style.ACTIVE_COLOUR, style.MARK_COLOUR, '#009e73', '#cc79a7')
"""Colours of the four tracked elements."""


def draw_all(study: Study, folder: Path) -> list[Path]:
    """Draw both figures; return their files.

    Raises:
        OSError: One cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    with style.style_context():
        return [
            *style.save_figure(draw_speeds(study), folder / 'measured_speeds'),
            *style.save_figure(draw_fronts(study), folder / 'measured_fronts'),
        ]


def draw_speeds(study: Study) -> Any:
    """Return the figure of all speeds against the spacing, a panel per rail."""
    figure = style.new_figure(3.4)
    for axes, rail in zip(
        style.axes_grid(figure, 1, 3, sharey=True)[0], RAIL_DISTANCES_CM, strict=True
    ):
        cases = [Case(rail, spacing) for spacing in SPACINGS_CM]
        axes.plot(
            SPACINGS_CM,
            [AUTHORS_SPEEDS[c] for c in cases],
            's',
            color=style.FAINT_COLOUR,
            ms=5,
            label="authors' simulation",
        )
        axes.plot(
            SPACINGS_CM,
            [study.viscous.speed(c) for c in cases],
            ':',
            color=style.FAINT_COLOUR,
            label='damping alone, fitted at 6 cm',
        )
        for case in cases:
            _draw_speed(axes, study, case)
        axes.set_title(f'rails {rail:g} cm apart')
        axes.set_xlabel('spacing (cm)')
        axes.set_xticks(SPACINGS_CM)
        axes.set_xlim(5.6, 8.4)
        axes.set_ylim(0.0, 4.0)
    figure.axes[0].set_ylabel('speed (m/s)')
    handles, labels = figure.axes[2].get_legend_handles_labels()
    by_label = dict(zip(labels, handles, strict=True))
    figure.legend(
        by_label.values(), by_label.keys(), loc='outside lower center', ncols=3, title=DATA_CREDIT
    )
    return figure


def _draw_speed(axes: Any, study: Study, case: Case) -> None:
    x, fitted = case.spacing, case in study.steady.fitted
    if (band := study.bands.get(case)) is not None:
        axes.plot(
            [x, x],
            [band.low, min(band.high, 9.0)],
            color=style.ACTIVE_COLOUR,
            lw=6,
            alpha=0.25,
            label='nine of ten random chains',
        )
    axes.plot(
        x, study.steady.speed(case), 'D' if fitted else 'o', ms=7,
        mfc=style.ACTIVE_COLOUR if fitted else 'white', mec=style.ACTIVE_COLOUR,
        label='ours, fitted to this' if fitted else 'ours, predicted',
    )  # fmt: skip
    if case in SILENT_CASES:
        axes.plot(x, 0.08, 'x', color=style.INACTIVE_COLOUR, ms=8, label='measured: no wave')
    for run in load_runs(case):
        axes.plot(
            x + 0.12, run.speed, '_', color=style.INACTIVE_COLOUR, ms=10, mew=2, label='measured'
        )


def draw_fronts(study: Study) -> Any:
    """Return the figure of the measured fronts with ours, a panel per lattice that propagates."""
    figure = style.new_figure(7.0)
    grid = style.axes_grid(figure, 3, 3, sharex=True)
    for axes, case in zip(grid.T.ravel(), sorted(ALL_CASES), strict=True):
        if case in SILENT_CASES:
            axes.axis('off')
            axes.text(0.5, 0.5, f'{case}: no wave', ha='center', transform=axes.transAxes)
            continue
        for run in load_runs(case):
            for u, colour in zip(run.u, ELEMENT_COLOURS, strict=True):
                axes.plot(run.t - run.arrivals.mean(), u, color=colour, lw=0.8)
        wave = launch_wave(
            case,
            build_shell(study.steady.well(case)),
            study.steady.losses[case.rail],
            last=LAST + 6,
        )
        if np.isfinite(wave.speed):
            for j in range(FIRST, LAST + 1):
                axes.plot(
                    wave.t - wave.arrivals.mean(),
                    wave.u[:, j],
                    '--',
                    color=style.INK_COLOUR,
                    lw=0.8,
                )
        told = 'fitted' if case in study.steady.fitted else 'predicted'
        axes.set_title(f'{case}: speed {told}')
        axes.set_ylim(-0.4, 1.15 * measured_rest(case).max())
        axes.set_xlim(-130.0, 150.0)
    for axes in grid[:, 0]:
        axes.set_ylabel('displacement (cm)')
    for axes in grid[-1]:
        axes.set_xlabel('time (ms)')
    figure.supxlabel(
        f'Dashed: ours. {DATA_CREDIT}', fontsize=style.SMALL_FONT_SIZE - 2, color=style.INK_COLOUR
    )
    return figure
