# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How long a verified write takes from any level to any other, the quickest way and the paper's.

    python tools/transitions.py case_2 bits_4 --pairs 60

Of each preset all pairs of levels, or as many by chance: mean and worst time in time units,
writes that took a second try, and with `--energy` the mean work of actuator and transducer in
k_r a^2.
"""

from __future__ import annotations

import argparse
import itertools
from collections.abc import Callable, Iterable

import numpy as np

from mlmem_ros.device import MemoryElement, Settings, Write, new_element
from mlmem_ros.device.events import Outcome
from mlmem_ros.device.moves import paper_way
from mlmem_ros.device.presets import preset
from mlmem_ros.paper.meter import fit_meter
from mlmem_ros.physics import Design, level_of

Pair = tuple[int, int]


def outcome_of(element: MemoryElement, level: int) -> Outcome:
    """Write a level and return how that ended."""
    element.apply(Write(level))
    while True:
        for event in element.advance():
            if isinstance(event, Outcome):
                return event


def measure(
    design: Design, settings: Settings, pairs: Iterable[Pair], energy: bool = False
) -> None:
    """Print the times of the second write of every pair, told by direction."""
    element = new_element(design, settings)
    meter = fit_meter(element) if energy else None
    times: dict[bool, list[tuple[float, Pair]]] = {False: [], True: []}
    works: dict[bool, list[float]] = {False: [], True: []}
    again = wrong = 0
    for start, target in pairs:
        outcome_of(element, start)
        before = meter.books() if meter else np.zeros(4)
        outcome = outcome_of(element, target)
        if meter:
            works[target < start].append(float((meter.books() - before)[:2].sum()))
        took = (outcome.end_tick - outcome.start_tick) * element.tick
        times[target < start].append((took, (start, target)))
        again += outcome.attempts > 1
        wrong += not outcome.success or level_of(design, element.chain.configuration) != target
    for down, name in ((False, 'upward'), (True, 'downward')):
        if found := times[down]:
            mean, (worst, pair) = np.mean([each for each, _ in found]), max(found)
            print(f'    {name}: {len(found)}, mean {mean:.0f}, worst {worst:.0f} {pair}', end='')
            if meter:
                print(f', work {np.mean(works[down]):.3g}', end='')
    print(f'; second tries {again}, wrong {wrong}', flush=True)


def pairs_of(design: Design, most: int, seed: int) -> list[Pair]:
    """Return all pairs of different levels, or as many by chance."""
    pairs = list(itertools.permutations(range(design.levels), 2))
    if len(pairs) <= most:
        return pairs
    chosen = np.random.default_rng(seed).choice(len(pairs), most, replace=False)
    return [pairs[each] for each in sorted(chosen)]


def main() -> None:
    """Measure the presets that are named."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('presets', nargs='+')
    parser.add_argument('--pairs', type=int, default=240, help='at most so many of each preset')
    parser.add_argument('--seed', type=int, default=0)
    parser.add_argument('--only', nargs=2, type=int, metavar='LEVEL', help='one pair')
    parser.add_argument('--energy', action='store_true', help='the work, too')
    parser.add_argument('--quickest', action='store_true', help='that way alone')
    asked = parser.parse_args()
    ways: dict[str, Callable[[Settings], Settings]] = {'quickest': lambda s: s}
    if not asked.quickest:
        ways['paper'] = paper_way
    for name in asked.presets:
        design, settings = preset(name)
        for way, of in ways.items():
            print(f'{name}, {way}')
            pairs = [asked.only] if asked.only else pairs_of(design, asked.pairs, asked.seed)
            measure(design, of(settings), pairs, asked.energy)


if __name__ == '__main__':
    main()
