# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Random levels written in a row into one element, each looked at afterwards.

    python tools/random_writes.py bits_4 --writes 10000

A write is wrong if it says done and the true wall is elsewhere, failed if it says so. What the
echo caught are the writes that took more than one try.
"""

from __future__ import annotations

import argparse
from collections import Counter

import numpy as np

from mlmem_ros.device import Write, new_element
from mlmem_ros.device.events import Outcome
from mlmem_ros.device.presets import preset
from mlmem_ros.physics import level_of


def main() -> None:
    """Write, look, and tell the counts as they grow."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('preset')
    parser.add_argument('--writes', type=int, default=10_000)
    parser.add_argument('--seed', type=int, default=0)
    asked = parser.parse_args()
    design, settings = preset(asked.preset)
    element = new_element(design, settings)
    levels = np.random.default_rng(asked.seed).integers(design.levels, size=asked.writes)
    found: Counter[str] = Counter()
    before = -1
    for number, level in enumerate(map(int, levels), 1):
        element.apply(Write(level))
        outcome = None
        while outcome is None:
            ended = [event for event in element.advance() if isinstance(event, Outcome)]
            outcome = ended[0] if ended else None
        true = level_of(design, element.chain.configuration)
        found[f'{outcome.attempts} tries'] += 1
        found['failed'] += not outcome.success
        found['wrong'] += outcome.success and true != level
        found['time'] += outcome.end_tick - outcome.start_tick
        if outcome.attempts > 1 or not outcome.success or true != level:
            print(f'  {before} -> {level}: {outcome.attempts} tries, {outcome.error or true}')
        before = level
        if number % 250 == 0 or number == asked.writes:
            counts = {key: count for key, count in found.items() if key != 'time'}
            mean = found['time'] * element.tick / number
            print(f'{asked.preset}: {number} writes, {counts}, {mean:.0f} each', flush=True)


if __name__ == '__main__':
    main()
