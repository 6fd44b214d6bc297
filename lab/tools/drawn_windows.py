# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Run every move that is used at random points of its window, all directions as likely.

.venv/bin/python lab/tools/drawn_windows.py --points 100 --seed 5
"""

import argparse
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from typing import Any

from mlmem_lab.results import APART, FOLDER, save
from mlmem_lab.windows.window import NARROW, drawn, moves
from mlmem_ros.device.presets import PRESETS


def keep(found: Sequence[dict[str, Any]], tried: int, points: int, seed: int) -> None:
    """Save the moves that failed somewhere, of all that were tried."""
    result = {
        'radius': NARROW,
        'points': points,
        'moves': tried,
        'all points': tried * points,
        'failures': sum(each['failures'] for each in found),
        'moves that failed': len(found),
        'nearest': min((each['nearest'] for each in found), default=None),
        'share of the others, at most (95 %)': 1.0 - 0.05 ** (1.0 / points),
        'failed': found,
    }
    presets = [name for name in PRESETS if name not in APART]
    made = f'lab/tools/drawn_windows.py --points {points} --seed {seed}'
    save(FOLDER / 'drawn.json', result, made, seed, presets)


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--points', type=int, default=100, help='of every move')
    parser.add_argument('--seed', type=int, default=5, help='of the points')
    parser.add_argument('--workers', type=int, default=2, help='processes')
    asked = parser.parse_args()
    tasks = [(n, m) for n in PRESETS if n not in APART for m in moves(n, used=True)]
    with ProcessPoolExecutor(asked.workers) as pool:
        done = [pool.submit(drawn, *each, asked.points, asked.seed) for each in tasks]
        found = [
            {
                'preset': name, 'kind': each.kind, 'from': each.start,
                'failures': len(each.failures), 'nearest': round(each.failures[0]['radius'], 4),
            }
            for (name, _), each in zip(tasks, (one.result() for one in done), strict=True)
            if each.failures
        ]  # fmt: skip
    keep(found, len(tasks), asked.points, asked.seed)


if __name__ == '__main__':
    main()
