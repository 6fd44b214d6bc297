# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Verified writes of random elements, trained by a calibration or not.

python3 -m mlmem_lab.trained [PRESET ...] makes lab/results/trained.json. Into every element 16
random levels are written in a row. A write fails if it says so, and is wrong if the true wall is
nearer to another level. An element is learnt if its calibration succeeds and all writes do.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from statistics import median
from typing import Any

import numpy as np

from mlmem import Calibrate, Write
from mlmem.physics import Scatter, level_of, scattered
from mlmem.presets import preset

from .results import run
from .studies.bench import Bench
from .studies.style import S1, S2, label, new_figure

SEED, ELEMENTS, WRITES = 1000, 20, 16
"""Of the first element; elements of each scatter; writes into each."""

SHOWN = {
    'case_2': ('a', "the paper's Case II", (1.5e-4, 3e-4, 8e-4, 3e-3)),
    'bits_4': ('b', 'bits_4', (4e-3, 8e-3, 1.2e-2, 2e-2)),
}
"""Panel, title, and scatters of alpha, by preset."""

COUNTED: dict[str, dict[str, tuple[float, ...]]] = {
    name: {'alpha': amounts} for name, (*_, amounts) in SHOWN.items()
}
COUNTED |= {
    name: dict.fromkeys(('alpha', 'k_r', 'mass', 'offset'), (3e-4, 1e-3))
    for name in ('kick_2', 'kick_4')
}
"""Amounts by kind of scatter, by preset."""


def counted(name: str) -> list[dict[str, Any]]:
    """Return how often writes into the elements of a preset failed, by scatter and training."""
    return [
        _count(name, kind, amount, trained)
        for kind, amounts in COUNTED[name].items()
        for amount in amounts
        for trained in (False, True)
    ]


def _count(name: str, kind: str, amount: float, trained: bool) -> dict[str, Any]:
    """Write into elements whose cells scatter, and return how often that failed."""
    design, settings = preset(name)
    found = {'failed': 0, 'wrong': 0, 'again': 0, 'learnt': 0, 'calibrations failed': 0}
    times, calibrating = [], []
    for number in range(SEED, SEED + ELEMENTS):
        element = Bench(design, settings).device()
        element.chain.set_specimen(scattered(design, Scatter(**{kind: amount}), number))
        lost = 0
        if trained:
            outcome = element.perform(Calibrate())
            calibrating.append(outcome.end_tick - outcome.start_tick)
            found['calibrations failed'] += not outcome.success
            lost += not outcome.success
        for level in map(int, np.random.default_rng(number).integers(design.levels, size=WRITES)):
            outcome = element.perform(Write(level))
            there = level_of(design, element.chain.configuration, design.J / 2) == level
            found['failed'] += not outcome.success
            found['wrong'] += outcome.success and not there
            found['again'] += outcome.attempts > 1
            lost += not (outcome.success and there)
            times.append(outcome.end_tick - outcome.start_tick)
        found['learnt'] += not lost
    return {
        'kind': kind, 'amount': amount, 'trained': trained, 'elements': ELEMENTS,
        'writes': ELEMENTS * WRITES, **found, 'tick': settings.time.tick,
        'write': median(times), 'calibration': median(calibrating or [0]),
        'longest calibration': max(calibrating, default=0),
    }  # fmt: skip


def draw(result: Mapping[str, Any]) -> Any:
    """Draw the share of writes that failed or were wrong; where none was, its bound 3 / n."""
    figure = new_figure(3.4)
    panels = zip(figure.subplots(1, 2, sharey=True), SHOWN.items(), strict=True)
    for axes, (name, (letter, title, amounts)) in panels:
        for trained, colour in ((False, S1), (True, S2)):
            rows = [
                each for each in result['presets'][name]
                if each['trained'] == trained and each['kind'] == 'alpha'
            ]  # fmt: skip
            alpha = [each['amount'] for each in rows]
            lost = np.array([each['failed'] + each['wrong'] for each in rows])
            share = np.maximum(lost, 3.0) / [each['writes'] for each in rows]
            words = 'trained' if trained else 'untrained'
            axes.plot(alpha, share, color=colour, label=words)
            for none, mark in ((False, 'o'), (True, 'v')):
                which = (lost == 0) == none
                axes.plot(np.array(alpha)[which], share[which], mark, color=colour, ms=6)
        axes.set(xscale='log', yscale='log', ylim=(1e-3, 1.3), xlabel=r'scatter of $\alpha_j$')
        axes.set_xticks(amounts, [f'{each:g}' for each in amounts])
        axes.minorticks_off()
        label(axes, letter, title)
    figure.axes[0].set_ylabel('share of writes that fail')
    figure.axes[0].legend(loc='lower right')
    return figure


if __name__ == '__main__':
    modules = ['lab/mlmem_lab/studies/bench.py']
    sys.exit(run('trained', __doc__, counted, SEED, None, COUNTED, draw, modules))
