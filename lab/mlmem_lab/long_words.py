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
from collections.abc import Mapping
from typing import Any

import numpy as np

from mlmem_ros.device import new_element, preset
from mlmem_ros.device.presets import PRESETS
from mlmem_ros.device.words import Code
from mlmem_ros.physics.specimen import Scatter

from .reads.count import IN_A_ROW, made
from .results import run
from .words import Trouble, between, reads, specimens, troubles, writes

SEED, WRITES, HEALTHY, EACH, BETWEEN = 1, 16, 500, 24, 100

DENSE = 'none, walls at every third or fifth level'


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
    kinds = troubles(
        element.design.N, element.settings.register.A,
        (1e-4, 3e-4, 1e-3), (1e-4, 3e-4, 1e-3),
    )  # fmt: skip
    finer = made(name, 2)
    of_reads = {'none': reads(element, kinds.pop('none'), random, HEALTHY, IN_A_ROW)}
    of_reads[DENSE] = reads(
        element, lambda random: Trouble(), random, EACH, 1, dense(element.register.code)
    )
    for what, each in kinds.items():
        of_reads[what] = reads(
            finer if what == 'half the time step' else element, each, random, EACH, 1
        )
    of_reads['walls at levels of no word'] = between(made(name), random, BETWEEN)
    begin = time.process_time()
    of_writes = writes(specimens(name, Scatter(), 1), random, WRITES)
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
    registers = [name for name, (_, settings) in PRESETS.items() if settings.register.shifted]
    modules = ['lab/mlmem_lab/reads/count.py', 'lab/mlmem_lab/words.py']
    sys.exit(run('long_words', __doc__, counted, SEED, joined, registers, modules=modules))
