# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a long register bears: python3 -m mlmem_lab.long_words makes results/long_words.json.

As `mlmem_lab.words`, of registers that are shifted: fewer words, for each takes thousands of
ticks, and faults anywhere in a longer element. Noise is relative to the pulse of a read.
"""

from __future__ import annotations

import itertools
import sys
import time
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from mlmem_ros.device import Faults, new_element, preset
from mlmem_ros.device.presets import PRESETS
from mlmem_ros.device.words import Code
from mlmem_ros.physics.specimen import Scatter

from .results import run, with_reads
from .words import Rng, Trouble, reads, writes

SEED, WRITES, HEALTHY, EACH = 1, 16, 40, 12

DENSE = 'none, walls at every third or fifth level'


def troubles(cells: int, pulse: float) -> dict[str, Callable[[Rng], Trouble]]:
    """Return troubles by name: each draws one, in an element of so many cells."""

    def cell(random: Rng) -> int:
        return int(random.integers(2, cells))

    def scattered(size: float) -> Callable[[Rng], Trouble]:
        return lambda random: Trouble(Faults(disorder_alpha=size, seed=cell(random)))

    def noise(size: float) -> Callable[[Rng], Trouble]:
        return lambda random: Trouble(Faults(sensor_noise=size * pulse, seed=cell(random)))

    return {
        'none': lambda random: Trouble(),
        DENSE: lambda random: Trouble(),
        'a cell half as stiff': lambda random: Trouble(
            Faults(weak_cell=cell(random), weak_factor=0.5)
        ),
        'a stuck cell': lambda random: Trouble(Faults(stuck_cell=cell(random))),
        'alpha scattered by 0.0001': scattered(1e-4),
        'alpha scattered by 0.0003': scattered(3e-4),
        'alpha scattered by 0.001': scattered(1e-3),
        'noise of 0.0001 of the pulse': noise(1e-4),
        'noise of 0.0003 of the pulse': noise(3e-4),
        'noise of 0.001 of the pulse': noise(1e-3),
    }


def dense(code: Code) -> list[int]:
    """Return words with walls at every third level, or at every third and fifth in turn."""
    found = list[tuple[int, ...]]()
    for distances in ((3,), (5,), (3, 5), (3, 3, 5)):
        places = itertools.accumulate(itertools.cycle(distances), initial=len(found))
        found.append(tuple(itertools.takewhile(lambda level: level < code.levels, places)))
    return [code.word(walls) for walls in found]


def counted(name: str) -> dict[str, Any]:
    """Return the counts of a preset, by fault, and of its writes; seconds are of the processor."""
    random = np.random.Generator(np.random.PCG64(SEED))
    element = new_element(preset(name))
    assert element.register is not None
    of_reads = {
        what: reads(
            element, each, random, HEALTHY if what == 'none' else EACH, 1,
            dense(element.register.code) if what == DENSE else (),
        )
        for what, each in troubles(element.design.N, element.settings.register.A).items()
    }  # fmt: skip
    begin = time.process_time()
    of_writes = writes(name, Scatter(), random, WRITES, 1)
    of_writes['seconds'] = round((time.process_time() - begin) / WRITES, 1)
    return {'reads': of_reads, 'writes': of_writes}


def joined(kept: Mapping[str, Any], name: str, found: Any) -> dict[str, Any]:
    """Return the counts of every preset, and how many reads there were, and how many wrong."""
    presets = kept.get('presets', {}) | {name: found}
    each = [counts for one in presets.values() for counts in one['reads'].values()]
    total = {
        'reads': sum(sum(counts.values()) for counts in each),
        'wrong': sum(counts['wrong'] for counts in each),
        'written': sum(one['writes']['right'] for one in presets.values()),
        'written wrong': sum(one['writes']['wrong'] for one in presets.values()),
    }
    return {'all': total, 'presets': presets}


if __name__ == '__main__':
    registers = {
        name: with_reads([name])
        for name, (_, settings) in PRESETS.items()
        if settings.register.shifted
    }
    sys.exit(run('long_words', __doc__, counted, SEED, joined, registers))
