# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""All nine lattices from the force curves of their shells: what they predict, unseen and seen."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mlmem.physics.potential import Array

from ..studies import style
from .posterior import LOSS_MODELS, Model, Particles
from .runs import ALL_CASES, RAIL_DISTANCES_CM, SILENT_CASES, SPACINGS_CM, load_runs
from .shells import TESTS_BY_RAIL, load_force_table

PREDICTION_QUANTILES = (0.5, 0.05, 0.95)
"""Of a prediction: its median and the ends of its interval."""

Progress = Callable[[str, float], None]


def predict_studied(particles: int, seed: int, tell: Progress = lambda *_: None) -> dict[str, Any]:
    """Return evidence, what was found of the unknowns, and predictions of every lattice.

    Args:
        particles: How many draws of the posterior.
        seed: Of random numbers.
        tell: Called with what is being done, and the share done.
    """
    found: dict[str, tuple[Model, Particles, float]] = {}
    for losses in LOSS_MODELS:
        model = Model(losses, np.random.default_rng(seed))
        for done, at, evidence in model.sample(particles):
            found[losses] = model, at, evidence
            tell(f'losses: {losses}', done)
    best = max(found, key=lambda losses: found[losses][2])
    model, at, _ = found[best]
    before = model.draw(particles)
    rows = []
    for k, case in enumerate(ALL_CASES):
        each = np.full(len(at.speed), 1.0 / len(at.speed))
        rows.append({
            'rail': case.rail, 'spacing': int(case.spacing),
            'measured': None if case in SILENT_CASES else [run.speed for run in load_runs(case)],
            'curves': summarise_speeds(before.speed[:, k], each),
            'seen': summarise_speeds(at.speed[:, k], each),
            'gain': summarise_values(at.chains(k).gain()),
            'tilt': summarise_values(10.0 * at.tilt[:, k]),
        })  # fmt: skip
    damping, _, _, magnets, scatter = at.common.T
    return {
        'cases': rows,
        'losses': best,
        'evidence': {losses: each[2] for losses, each in found.items()},
        'damping': summarise_values(np.exp(damping)),
        'magnets': summarise_values(np.exp(magnets)),
        'scatter': summarise_values(10.0 * scatter),
        'friction': summarise_values(10.0 * found['friction'][1].common[:, 2]),
        'tests': [
            {
                'rail': rail,
                'test': name,
                'well': 10.0 * load_force_table(name)[1],
                'gain': -100.0
                * load_force_table(name)[1]
                * float(load_force_table(name)[0][200:401].mean()),
                'share': float(at.laws(r)[:, k].mean()),
            }
            for r, rail in enumerate(RAIL_DISTANCES_CM)
            for k, name in enumerate(TESTS_BY_RAIL[rail])
        ],
        'particles': particles,
    }


def predict_unseen(particles: int, seed: int, tell: Progress = lambda *_: None) -> dict[str, Any]:
    """Return a prediction of every lattice from the curves and the data of the others.

    With viscous damping alone. Args as in `predict_studied`.
    """
    rows = []
    for k, case in enumerate(ALL_CASES):
        model = Model('viscous', np.random.default_rng(seed))
        for done, found, _ in model.sample(particles, without=k):
            at = found
            tell(f'without {case}', (k + done) / len(ALL_CASES))
        speeds = model.predicted(at, k).ravel()
        rows.append({
            'rail': case.rail, 'spacing': int(case.spacing),
            'measured': None if case in SILENT_CASES else [run.speed for run in load_runs(case)],
            'unseen': summarise_speeds(speeds, np.full(len(speeds), 1.0 / len(speeds))),
        })  # fmt: skip
    return {'cases': rows, 'speeds': compare_speeds(rows), 'particles': particles}


def compare_speeds(cases: Sequence[Mapping[str, Any]]) -> dict[str, float | None]:
    """Return how many measured speeds there are, and how many lie in the interval of
    `predict_unseen`.

    Also the least and the largest error of the medians of these, in per cent.
    """
    speeds = [(float(np.mean(row['measured'])), row['unseen']) for row in cases if row['measured']]
    off = [
        100.0 * abs(found['median'] / seen - 1.0)
        for seen, found in speeds
        if found['median'] is not None and found['low'] <= seen <= found['high']
    ]
    return {
        'measured': len(speeds), 'inside': len(off),
        'least': min(off, default=None), 'largest': max(off, default=None),
    }  # fmt: skip


def summarise_values(values: Array) -> dict[str, float]:
    """Return median and interval of equally probable values."""
    middle, low, high = np.quantile(values, PREDICTION_QUANTILES)
    return {'median': float(middle), 'low': float(low), 'high': float(high)}


def summarise_speeds(speeds: Array, weights: Array) -> dict[str, float | None]:
    """Return the share of silence, and median and interval of the speeds of waves."""
    waves = np.isfinite(speeds)
    silent = float(weights[~waves].sum())
    if not waves.any():
        return {'silent': silent, 'median': None, 'low': None, 'high': None}
    order = np.argsort(speeds[waves])
    rising, share = speeds[waves][order], np.cumsum(weights[waves][order])
    at = np.searchsorted(share, np.array(PREDICTION_QUANTILES) * share[-1])
    middle, low, high = rising[np.minimum(at, len(rising) - 1)].tolist()
    return {'silent': silent, 'median': middle, 'low': low, 'high': high}


def draw_speeds(study: dict[str, Any], left: dict[str, Any], folder: Path) -> list[Path]:
    """Draw speeds with intervals, a panel per rail, of `predict_studied` and `predict_unseen`;
    return the files.

    Raises:
        OSError: One cannot be written.
    """
    with style.style_context():
        figure = style.new_figure(3.6)
        panels = style.axes_grid(figure, 1, 3, sharey=True)[0]
        for axes, rail in zip(panels, RAIL_DISTANCES_CM, strict=True):
            for row, other in zip(study['cases'], left['cases'], strict=True):
                if row['rail'] == rail:
                    _draw_row(axes, row | other)
            axes.set_title(f'rails {rail:g} cm apart')
            axes.set_xlabel('spacing (cm)')
            axes.set_xticks(SPACINGS_CM)
            axes.set_xlim(5.5, 8.5)
            axes.set_ylim(-0.1, 6.0)
        panels[0].set_ylabel('speed (m/s)')
        handles: dict[str, Any] = {}
        for axes in panels:
            for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
                handles.setdefault(label, handle)
        figure.legend(handles.values(), handles.keys(), loc='outside lower center', ncols=3)
        return style.save_figure(figure, folder / 'measured_curves')


def _draw_row(axes: Any, row: dict[str, Any]) -> None:
    x = row['spacing']
    looks = (
        ('curves', -0.25, style.FAINT_COLOUR, 'from the force curves alone'),
        ('unseen', 0.0, style.ACTIVE_COLOUR, 'this lattice left out'),
        ('seen', 0.25, style.MARK_COLOUR, 'with its data'),
    )
    for name, aside, colour, label in looks:
        given = row[name]
        likely = 1.0 - given['silent']
        axes.text(
            x + aside, 0.05, f'{100 * given["silent"]:.0f}', ha='center', fontsize=6, color=colour
        )
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
        axes.plot(
            [x - 0.4, x + 0.4], [speed] * 2, color=style.INACTIVE_COLOUR, lw=1, label='measured'
        )


def main() -> None:
    """Draw the picture of the page from the committed results: both are made by the command."""
    from ..results import CHECKOUT_ROOT, RESULT_FOLDER, keep_picture, load_result

    files = 'curves.json', 'unseen.json'
    study, left = (load_result(RESULT_FOLDER / name) for name in files)
    modules = ['lab/mlmem_lab/measured/curves.py', *(f'lab/results/{name}' for name in files)]
    picture, drawing = draw_speeds(study, left, CHECKOUT_ROOT / 'docs' / 'images')
    drawing.unlink()  # a page shows the other one
    keep_picture(picture, 'python3 -m mlmem_lab.measured.curves', modules)


if __name__ == '__main__':
    main()
