# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Predict the transition waves of nine measured lattices from the force curves of their shells.

`curves` compares what the force curves alone say of every lattice with what its own data add.
`unseen` predicts each lattice from the force curves and the data of the others.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from mlmem.physics.values import Array

from ..study import Study
from .posterior import Model
from .runs import ALL_CASES, SILENT_CASES, Case, load_runs


def predict_seen(case: str, seed: int, particles: int = 250) -> dict[str, Any]:
    """Return predictions of every lattice, by name, from the force curves alone, and with all
    data.

    Losses are viscous damping and a loss in the snap. The one case is `all`.
    """
    model = Model(np.random.default_rng(seed), snap=True)
    posterior = model.sample_posterior(particles)
    prior = model.draw_prior(particles)
    return {
        str(lattice): {
            'curves': summarise_speeds(prior.speed[:, k]),
            'seen': summarise_speeds(posterior.speed[:, k]),
            'gain': summarise_values(posterior.build_chains(k).compute_gain()),
        }
        for k, lattice in enumerate(ALL_CASES)
    }


def predict_unseen(case: str, seed: int, particles: int = 200) -> dict[str, Any]:
    """Return the prediction of a lattice from the force curves and the data of the others.

    The loss is viscous damping alone.
    """
    k = [str(each) for each in ALL_CASES].index(case)
    model = Model(np.random.default_rng(seed), snap=False)
    speeds = model.predict_speeds(model.sample_posterior(particles, without=k), k)
    return {'measured': _list_speeds(ALL_CASES[k]), 'unseen': summarise_speeds(speeds.ravel())}


def _list_speeds(case: Case) -> list[float] | None:
    """Return the measured speeds in m/s; None without a wave."""
    return None if case in SILENT_CASES else [run.speed for run in load_runs(case)]


def attribute_data(presets: Mapping[str, Any]) -> dict[str, Any]:
    """Return the attribution that the licence of the measured data requires."""
    return {
        'attribution': 'Measured: Nadkarni, Arrieta, Chong, Kochmann & Daraio, Phys. Rev. Lett. '
        '116, 244501 (2016), Daraio-lab/Neel-PRL, CC BY 4.0'
    }


def compare_speeds(presets: Mapping[str, Any]) -> dict[str, Any]:
    """Return how many measured speeds there are, and how many lie in the unseen interval.

    Also the least and the largest error of the medians of these, in per cent.
    """
    rows = [row for row in presets.values() if row['measured']]
    speeds = [(float(np.mean(row['measured'])), row['unseen']) for row in rows]
    errors = [
        100.0 * abs(found['median'] / seen - 1.0)
        for seen, found in speeds
        if found['median'] is not None and found['low'] <= seen <= found['high']
    ]
    compared = {
        'measured': len(speeds), 'inside': len(errors),
        'least': min(errors, default=None), 'largest': max(errors, default=None),
    }  # fmt: skip
    return attribute_data(presets) | {'speeds': compared}


def summarise_values(values: Array) -> dict[str, float]:
    """Return median and interval of equally probable values."""
    quantiles = (0.5, 0.05, 0.95)  # of a prediction: its median and the ends of its interval
    middle, low, high = np.quantile(values, quantiles)
    return {'median': float(middle), 'low': float(low), 'high': float(high)}


def summarise_speeds(speeds: Array) -> dict[str, float | None]:
    """Return the share of draws without a wave, and median and interval of the other speeds."""
    waves = np.isfinite(speeds)
    silent: dict[str, float | None] = {'silent': float(1.0 - waves.mean())}
    if not waves.any():
        return silent | {'median': None, 'low': None, 'high': None}
    return silent | summarise_values(speeds[waves])


curves_study = Study(
    'curves', predict_seen, ('all',), ('lab/mlmem_lab/measured',), 1, attribute_data
)
unseen_study = Study(
    'unseen', predict_unseen, tuple(map(str, ALL_CASES)), curves_study.modules, 1,
    compare_speeds,
)  # fmt: skip
