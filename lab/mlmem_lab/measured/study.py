# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Predict the transition waves of nine measured lattices from the force curves of their shells.

`curves` compares what the force curves alone say of every lattice with what its own data add.
`unseen` predicts each lattice from the force curves and the data of the others.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mlmem.physics.potential import Array

from ..results import RESULT_FOLDER, load_result
from ..studies import style
from ..study import Study
from .posterior import Model
from .runs import ALL_CASES, RAIL_DISTANCES_CM, SILENT_CASES, SPACINGS_CM, load_runs

DATA_ATTRIBUTION = (
    'Measured: Nadkarni, Arrieta, Chong, Kochmann & Daraio, Phys. Rev. Lett. 116, 244501 (2016), '
    'Daraio-lab/Neel-PRL, CC BY 4.0'
)


SEED = 1


def predict_seen(case: str, particles: int = 250) -> list[dict[str, Any]]:
    """Return predictions of every lattice from the force curves alone, and with all data.

    Losses are viscous damping and a loss in the snap. The one case is `all`.
    """
    model = Model(np.random.default_rng(SEED), snap=True)
    posterior = model.sample_posterior(particles)
    prior = model.draw_prior(particles)
    return [
        _describe_lattice(k)
        | {
            'curves': summarise_speeds(prior.speed[:, k]),
            'seen': summarise_speeds(posterior.speed[:, k]),
            'gain': summarise_values(posterior.build_chains(k).compute_gain()),
        }
        for k in range(len(ALL_CASES))
    ]


def predict_unseen(case: str, particles: int = 200) -> list[dict[str, Any]]:
    """Return the prediction of a lattice from the force curves and the data of the others.

    The loss is viscous damping alone.
    """
    k = [str(each) for each in ALL_CASES].index(case)
    model = Model(np.random.default_rng(SEED), snap=False)
    speeds = model.predict_speeds(model.sample_posterior(particles, without=k), k)
    return [_describe_lattice(k) | {'unseen': summarise_speeds(speeds.ravel())}]


def _describe_lattice(k: int) -> dict[str, Any]:
    """Return rail and spacing in cm, and the measured speeds in m/s; None without a wave."""
    case = ALL_CASES[k]
    speeds = None if case in SILENT_CASES else [run.speed for run in load_runs(case)]
    return {'rail': case.rail, 'spacing': int(case.spacing), 'measured': speeds}


def add_rows(kept: Mapping[str, Any], case: str, found: Sequence[Any]) -> dict[str, Any]:
    """Return the rows of all lattices, in order, and how unseen ones compare."""
    rows = {(row['rail'], row['spacing']): row for row in (*kept.get('cases', ()), *found)}
    cases = [rows[key] for key in sorted(rows)]
    result: dict[str, Any] = {'attribution': DATA_ATTRIBUTION, 'cases': cases}
    return result | ({'speeds': compare_speeds(cases)} if 'unseen' in cases[0] else {})


def compare_speeds(cases: Sequence[Mapping[str, Any]]) -> dict[str, float | None]:
    """Return how many measured speeds there are, and how many lie in the unseen interval.

    Also the least and the largest error of the medians of these, in per cent.
    """
    speeds = [(float(np.mean(row['measured'])), row['unseen']) for row in cases if row['measured']]
    errors = [
        100.0 * abs(found['median'] / seen - 1.0)
        for seen, found in speeds
        if found['median'] is not None and found['low'] <= seen <= found['high']
    ]
    return {
        'measured': len(speeds), 'inside': len(errors),
        'least': min(errors, default=None), 'largest': max(errors, default=None),
    }  # fmt: skip


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


def draw_speeds(result: Mapping[str, Any]) -> Any:
    """Draw speeds with intervals, a panel per rail, of `curves` and of the result of `unseen`."""
    unseen = load_result(RESULT_FOLDER / 'unseen.json')
    figure = style.new_figure(3.6)
    panels = style.axes_grid(figure, 1, 3, sharey=True)[0]
    for axes, rail in zip(panels, RAIL_DISTANCES_CM, strict=True):
        for row, other in zip(result['cases'], unseen['cases'], strict=True):
            if row['rail'] == rail:
                _draw_row(axes, row | other)
        axes.set_title(f'rails {rail:g} cm apart')
        axes.set(xlabel='spacing (cm)', xticks=SPACINGS_CM, xlim=(5.5, 8.5), ylim=(-0.1, 6.0))
    panels[0].set_ylabel('speed (m/s)')
    handles: dict[str, Any] = {}
    for axes in panels:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            handles.setdefault(label, handle)
    figure.legend(handles.values(), handles.keys(), loc='outside lower center', ncols=3)
    return figure


def _draw_row(axes: Any, row: Mapping[str, Any]) -> None:
    """Draw the predictions of a lattice, and its measured speeds."""
    x = row['spacing']
    for name, aside, colour, label in (
        ('curves', -0.25, style.FAINT_COLOUR, 'from the force curves alone'),
        ('unseen', 0.0, style.ACTIVE_COLOUR, 'this lattice left out'),
        ('seen', 0.25, style.MARK_COLOUR, 'with its data'),
    ):
        given = row[name]
        likely = 1.0 - given['silent']
        percent = f'{100 * given["silent"]:.0f}'
        axes.text(x + aside, 0.05, percent, ha='center', fontsize=6, color=colour)
        if given['median'] is None or likely < 0.05:
            continue
        axes.plot(
            [x + aside] * 2, [given['low'], given['high']], color=colour, lw=5,
            alpha=0.15 + 0.6 * likely, solid_capstyle='butt', label=label,
        )  # fmt: skip
        axes.plot(x + aside, given['median'], 'o', ms=4, color=colour)
    if row['measured'] is None:
        axes.plot(x, 0.6, 'x', color=style.INACTIVE_COLOUR, ms=8, label='no wave measured')
    for speed in row['measured'] or ():
        ends = [x - 0.4, x + 0.4]
        axes.plot(ends, [speed] * 2, color=style.INACTIVE_COLOUR, lw=1, label='measured')


MODULES = ('lab/mlmem_lab/measured',)
CURVES_STUDY = Study(
    'curves', predict_seen, ('all',), MODULES, SEED, add_rows, draw=draw_speeds
)  # fmt: skip
UNSEEN_STUDY = Study(
    'unseen', predict_unseen, tuple(map(str, ALL_CASES)), MODULES, SEED, add_rows
)  # fmt: skip
