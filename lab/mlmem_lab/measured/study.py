# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The predictions of all nine lattices, with bands, beside what was measured."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from .fits import Fit, front, steady, viscous
from .runs import AUTHORS, CASES, SILENT, Case, runs
from .scatter import (
    Scatter,
    force_scatter,
    greatest_friction,
    launch_chains,
    pattern,
    stopped,
    well_scatter,
)

BAND = (0.05, 0.95)
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
        steady, viscous, front: The fits; `steady` is ours, `front` only in a full study,
            as `left_out`, `friction`, `force` and `stops`.
        left_out: Speed of each case at 8 cm when it is left out of the fit `steady`, m/s.
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

    def rows(self) -> list[dict[str, Any]]:
        """Return a row per case: prediction, band, measurement, and the other models."""
        return [self._row(case) for case in CASES]

    def _row(self, case: Case) -> dict[str, Any]:
        band = self.bands.get(case)
        return {
            'rail': case.rail,
            'spacing': int(case.spacing),
            'speed': _number(self.steady.speed(case)),
            'fitted': case in self.steady.fitted,
            'low': band and band.low,
            'high': band and band.high,
            'stops': band and band.stops,
            'measured': [run.speed for run in runs(case)] if case not in SILENT else None,
            'viscous': _number(self.viscous.speed(case)),
            'front': self.front and _number(self.front.speed(case)),
            'authors': AUTHORS[case],
            'left_out': self.left_out.get(case),
            'friction_limit': self.friction.get(case),
        }

    def as_dict(self) -> dict[str, Any]:
        """Return everything as plain values."""
        return {
            'cases': self.rows(),
            'fits': {
                each.name: _told(each) for each in (self.steady, self.viscous, self.front) if each
            },
            'scatter': {'wells': self.wells, 'force': self.force},
            'stops': [
                {'force': force, 'pattern': pattern(by_case), **by_case}
                for force, by_case in self.stops.items()
            ],
            'chains': self.chains,
            'seed': self.seed,
        }


def studied(chains: int, seed: int, full: bool = False) -> Study:
    """Fit, predict, and launch random chains.

    Args:
        chains: Random chains a lattice; 0 for none, and no bands.
        seed: Of their random numbers.
        full: Whether to fit the fronts, and to find out how probable silence is with a force on
            each element, or with more friction; and leave out each fitted case in turn.
    """
    ours = steady()
    left_out, friction = {}, {}
    if full:
        left_out = {case: steady(left_out=case).speed(case) for case in ours.fitted}
        friction = {case: greatest_friction(case, ours) for case in CASES}
    wells = well_scatter(ours.fitted)
    generator = np.random.default_rng(seed)
    bands, force, stopping = {}, None, {}
    if chains:
        bands = {case: _band(case, ours, Scatter(wells), chains, generator) for case in CASES}
    if chains and full:
        force = force_scatter(ours, ours.fitted, wells, chains, seed)
        for size in (0.0, 0.5 * force, force):
            stopping[size] = {
                case: stopped(launch_chains(case, ours, Scatter(wells, size), chains, generator))
                for case in CASES
            }
    return Study(
        ours,
        viscous(),
        front() if full else None,
        left_out,
        friction,
        wells,
        bands,
        force,
        stopping,
        chains,
        seed,
    )


def _band(
    case: Case, fit: Fit, scatter: Scatter, chains: int, generator: np.random.Generator
) -> Band:
    waves = launch_chains(case, fit, scatter, chains, generator, uncertain=True)
    speeds = [wave.speed for wave in waves if np.isfinite(wave.speed)]
    low, high = np.quantile(speeds, BAND) if speeds else (np.nan, np.nan)
    return Band(float(low), float(high), stopped(waves))


def _told(fit: Fit) -> dict[str, Any]:
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


def _number(value: float) -> float | None:
    return value if np.isfinite(value) else None
