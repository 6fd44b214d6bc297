# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Verified writes in a row into one element: how long they take, and which go wrong.

    python lab/tools/writes.py case_2 bits_4
    python lab/tools/writes.py bits_4 --random 10000

Every level is written after every other once, or levels are random. A write is wrong if it says
done and the true wall is elsewhere, failed if it says so. Times are in time units, the work of
actuator and transducer in k_r a^2.
"""

from __future__ import annotations

import argparse
from collections import Counter
from itertools import combinations

import numpy as np

from mlmem_lab.paper.meter import fit_meter
from mlmem_ros.device import Settings, Write, new_element
from mlmem_ros.device.moves import paper_way
from mlmem_ros.device.presets import preset
from mlmem_ros.physics import Design, level_of


def every_pair(levels: int) -> list[int]:
    """Return levels in an order in which each follows each other one exactly once."""
    return [*(level for pair in combinations(range(levels), 2) for level in pair), 0]


def measure(design: Design, settings: Settings, levels: list[int], energy: bool) -> None:
    """Write levels, and print how upward and downward writes went."""
    element = new_element(design, settings)
    meter = fit_meter(element) if energy else None
    before, *levels = levels
    element.perform(Write(before))
    found: Counter[str] = Counter()
    times: dict[str, list[tuple[float, int, int]]] = {'up': [], 'down': []}
    works: dict[str, list[float]] = {'up': [], 'down': []}
    for level in levels:
        way = 'up' if level > before else 'down'
        spent = meter.books() if meter else np.zeros(4)
        outcome = element.perform(Write(level))
        if meter:
            works[way].append(float((meter.books() - spent)[:2].sum()))
        time = (outcome.end_tick - outcome.start_tick) * element.tick
        times[way].append((time, before, level))
        wrong = level_of(design, element.chain.configuration) != level
        found['failed'] += not outcome.success
        found['wrong'] += outcome.success and wrong
        found['second tries'] += outcome.attempts > 1
        if wrong or outcome.attempts > 1 or not outcome.success:
            print(
                f'    {before} -> {level}: {outcome.attempts} tries, {outcome.error}', flush=True
            )
        before = level
    for way, each in times.items():
        if each:
            mean, (worst, *pair) = np.mean([time for time, *_ in each]), max(each)
            work = f', work {np.mean(works[way]):.3g}' if meter else ''
            print(f'    {way}: {len(each)}, mean {mean:.0f}, worst {worst:.0f} {pair}{work}')
    print('   ', ', '.join(f'{count} {name}' for name, count in found.items()), flush=True)


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument('presets', nargs='+')
    parser.add_argument('--random', type=int, metavar='N', help='N writes of random levels')
    parser.add_argument('--seed', type=int, default=0, help='of the random levels')
    parser.add_argument('--energy', action='store_true', help='measure the work, too')
    parser.add_argument('--paper', action='store_true', help="the paper's way, not the quickest")
    given = parser.parse_args()
    for name in given.presets:
        design, settings = preset(name)
        levels = every_pair(design.levels)
        if given.random:
            random = np.random.default_rng(given.seed)
            ways = random.integers(1, design.levels, size=given.random + 1)
            levels = (
                np.cumsum(ways) % design.levels
            ).tolist()  # never the same one twice in a row
        print(name, flush=True)
        measure(design, paper_way(settings) if given.paper else settings, levels, given.energy)


if __name__ == '__main__':
    main()
