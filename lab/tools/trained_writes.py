# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Verified writes of random elements, trained by a calibration or not.

    python lab/tools/trained_writes.py bits_4 0.004 0.008 0.012 --elements 40 --counts counts.json
    python lab/tools/trained_writes.py --draw docs/images/learning --counts counts.json

Into every element 16 random levels are written in a row. A write fails if it says so, and is wrong
if the true wall is nearer to another level. Counts are added to a file, from which the picture is
drawn.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np

from mlmem_lab.studies.bench import Bench
from mlmem_lab.studies.style import S1, S2, label, new_figure, save_figure, styled
from mlmem_ros.device import Calibrate, Write
from mlmem_ros.device.presets import preset
from mlmem_ros.physics import Scatter, level_of, scattered

WRITES = 16
"""Writes into every element."""

SHOWN = {'case_2': ('a', "the paper's Case II"), 'bits_4': ('b', 'bits_4')}


def count(name: str, alpha: float, elements: int, seed: int, trained: bool) -> dict[str, Any]:
    """Write into elements whose alpha scatters, and return how often that failed."""
    design, settings = preset(name)
    found = {'failed': 0, 'wrong': 0, 'again': 0, 'elements failing': 0, 'calibrations failed': 0}
    times, calibrating = [], []
    for number in range(seed, seed + elements):
        element = Bench(design, settings).device()
        element.chain.set_specimen(scattered(design, Scatter(alpha=alpha), number))
        if trained:
            outcome = element.perform(Calibrate())
            calibrating.append((outcome.end_tick - outcome.start_tick) * element.tick)
            found['calibrations failed'] += not outcome.success
        before = found['failed'] + found['wrong']
        for level in map(int, np.random.default_rng(number).integers(design.levels, size=WRITES)):
            outcome = element.perform(Write(level))
            there = level_of(design, element.chain.configuration, design.J / 2) == level
            found['failed'] += not outcome.success
            found['wrong'] += outcome.success and not there
            found['again'] += outcome.attempts > 1
            times.append((outcome.end_tick - outcome.start_tick) * element.tick)
        found['elements failing'] += found['failed'] + found['wrong'] > before
    return {
        'preset': name, 'alpha': alpha, 'trained': trained, 'elements': elements,
        'writes': elements * WRITES, **found, 'mean time': round(float(np.mean(times))),
        'mean calibration': round(float(np.mean(calibrating))) if calibrating else 0,
    }  # fmt: skip


def draw(counts: list[dict[str, Any]], stem: Path) -> None:
    """Draw the share of writes that failed or were wrong; where none was, its bound 3 / n."""
    with styled():
        figure = new_figure(3.4)
        panels = zip(figure.subplots(1, 2, sharey=True), SHOWN.items(), strict=True)
        for axes, (name, (letter, title)) in panels:
            for trained, colour in ((False, S1), (True, S2)):
                chosen = (name, trained)
                rows = [each for each in counts if (each['preset'], each['trained']) == chosen]
                rows.sort(key=lambda each: each['alpha'])
                alpha = [each['alpha'] for each in rows]
                lost = np.array([each['failed'] + each['wrong'] for each in rows])
                share = np.maximum(lost, 3.0) / [each['writes'] for each in rows]
                words = 'trained' if trained else 'untrained'
                axes.plot(alpha, share, color=colour, label=words)
                for none, mark in ((False, 'o'), (True, 'v')):
                    which = (lost == 0) == none
                    axes.plot(np.array(alpha)[which], share[which], mark, color=colour, ms=6)
            axes.set(xscale='log', yscale='log', ylim=(1e-3, 1.3), xlabel=r'scatter of $\alpha_j$')
            amounts = sorted({each['alpha'] for each in counts if each['preset'] == name})
            axes.set_xticks(amounts, [f'{each:g}' for each in amounts])
            axes.minorticks_off()
            label(axes, letter, title)
        figure.axes[0].set_ylabel('share of writes that fail')
        figure.axes[0].legend(loc='lower right')
        save_figure(figure, stem)


def main() -> None:
    """Count, or draw what was counted."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('preset', nargs='?')
    parser.add_argument('alpha', nargs='*', type=float)
    parser.add_argument('--elements', type=int, default=20)
    parser.add_argument('--seed', type=int, default=1000)
    parser.add_argument('--untrained', action='store_true')
    parser.add_argument('--counts', type=Path, required=True)
    parser.add_argument('--draw', type=Path)
    asked = parser.parse_args()
    counts = json.loads(asked.counts.read_text()) if asked.counts.exists() else []
    for alpha in asked.alpha:
        counts.append(count(asked.preset, alpha, asked.elements, asked.seed, not asked.untrained))
        print(counts[-1], flush=True)
        asked.counts.write_text(json.dumps(counts, indent=1))
    if asked.draw:
        draw(counts, asked.draw)


if __name__ == '__main__':
    main()
