# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a long register bears: python3 -m mlmem_lab.long_words makes results/long_words.json.

As `mlmem_lab.words`, of registers that are shifted: fewer words, for each takes thousands of
ticks, and faults anywhere in a longer element. Noise is relative to the pulse of a read.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from mlmem_ros.device import Faults, new_element, preset
from mlmem_ros.device.presets import PRESETS
from mlmem_ros.physics.specimen import Scatter

from .results import run, with_reads
from .words import Rng, reads, writes

SEED, WRITES, HEALTHY, EACH = 1, 8, 16, 6


def faults(cells: int, pulse: float) -> dict[str, Callable[[Rng], Faults]]:
    """Return faults by name: each draws one, in an element of so many cells."""

    def cell(random: Rng) -> int:
        return int(random.integers(2, cells))

    return {
        'none': lambda random: Faults(),
        'a cell half as stiff': lambda random: Faults(weak_cell=cell(random), weak_factor=0.5),
        'a stuck cell': lambda random: Faults(stuck_cell=cell(random)),
        'alpha scattered by 0.0001': lambda random: Faults(disorder_alpha=1e-4, seed=cell(random)),
        'alpha scattered by 0.001': lambda random: Faults(disorder_alpha=1e-3, seed=cell(random)),
        'noise of 0.0001 of the pulse': lambda random: Faults(
            sensor_noise=1e-4 * pulse, seed=cell(random)
        ),
        'noise of 0.001 of the pulse': lambda random: Faults(
            sensor_noise=1e-3 * pulse, seed=cell(random)
        ),
    }


def counted(name: str) -> dict[str, Any]:
    """Return the counts of a preset, by fault, and of its writes; seconds are of the processor."""
    random = np.random.Generator(np.random.PCG64(SEED))
    element = new_element(preset(name))
    drawn = faults(element.design.N, element.settings.register.A)
    of_reads = {
        what: reads(element, each, random, HEALTHY if what == 'none' else EACH)
        for what, each in drawn.items()
    }
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
