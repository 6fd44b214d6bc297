# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What many walls bear: python3 -m mlmem_lab.words [PRESET ...] makes results/words.json.

Random words of a register are read with every kind of fault, and written, each from the one
before, on specimens whose alpha or coupling springs scatter. A read is wrong if it succeeds with
another word than that of the true walls, a write if it is acknowledged so. Nothing is discarded.
"""

from __future__ import annotations

import itertools
import sys
from collections import Counter
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from mlmem_ros.device import Faults, MemoryElement, Read, Write, new_element, preset
from mlmem_ros.device.driver import Simulation
from mlmem_ros.device.presets import PRESETS
from mlmem_ros.device.register import resting
from mlmem_ros.physics import Specimen
from mlmem_ros.physics.specimen import Scatter, scattered

from .reads.count import true_level
from .results import run, with_reads

SEED, COUNT = 1, 200

Rng = np.random.Generator


def _cell(random: Rng) -> int:
    return int(random.integers(2, 225))  # of the shortest


FAULTS: dict[str, Callable[[Rng], Faults]] = {
    'none': lambda random: Faults(),
    'a cell half as stiff': lambda random: Faults(weak_cell=_cell(random), weak_factor=0.5),
    'a cell of any lower stiffness': lambda random: Faults(
        weak_cell=_cell(random), weak_factor=float(random.uniform(0.01, 1.0))
    ),
    'a stuck cell': lambda random: Faults(stuck_cell=_cell(random)),
    'alpha scattered by 0.001': lambda random: Faults(disorder_alpha=1e-3, seed=_cell(random)),
    'alpha scattered by 0.003': lambda random: Faults(disorder_alpha=3e-3, seed=_cell(random)),
    'alpha scattered by 0.01': lambda random: Faults(disorder_alpha=1e-2, seed=_cell(random)),
    'noise of 0.001 of the pulse': lambda random: Faults(sensor_noise=1e-5, seed=_cell(random)),
    'noise of 0.01 of the pulse': lambda random: Faults(sensor_noise=1e-4, seed=_cell(random)),
    'sensors that freeze in 2 % of ticks': lambda random: Faults(
        sensor_dropout=0.02, seed=_cell(random)
    ),
    'damping of half to eight times': lambda random: Faults(
        damping_factor=float(random.uniform(0.5, 8.0))
    ),
}
"""By name: draws one."""

SCATTERED = (3e-4, 1e-3, 3e-3)


def drawn(random: Rng, words: int) -> int:
    """Return a random word of so many; of more than an integer holds, by twice as many bits."""
    if words < 2**63:
        return int(random.integers(words))
    return int.from_bytes(random.bytes(words.bit_length() // 4), 'big') % words


def reads(
    element: MemoryElement, faults: Callable[[Rng], Faults], random: Rng, count: int = COUNT
) -> dict[str, int]:
    """Read random words at rest with faults; return how many ended how."""
    found = Counter[str]()
    code = element.register.code if element.register else None
    assert code is not None
    for _ in range(count):
        word, given = drawn(random, code.words), faults(random)
        element.set_faults(Faults())
        element.chain.place(resting(Specimen(element.design), code.walls(word)))
        element.transducer.assume_rest()
        element.set_faults(given)
        outcome = element.perform(Read())
        element.transducer.release()
        read = outcome.reading.level if outcome.success and outcome.reading else None
        found['undecodable' if read is None else 'right' if read == word else 'wrong'] += 1
    element.set_faults(Faults())
    return {name: found[name] for name in ('right', 'undecodable', 'wrong')}


def writes(
    name: str, scatter: Scatter, random: Rng, count: int = COUNT, specimens: int = 10
) -> dict[str, Any]:
    """Write random words in a row on some specimens; return how many ended how."""
    found, ticks = Counter[str](), []
    for number in range(specimens):
        element = _specimen(name, scatter, number)
        for _ in range(count // specimens):
            word = drawn(random, element.words)
            outcome = element.perform(Write(word))
            ticks.append(outcome.end_tick - outcome.start_tick)
            true = true_level(element) == word
            found['right' if outcome.success and true else 'not written'] += (
                true or not outcome.success
            )
            found['wrong'] += outcome.success and not true
            found['first attempt'] += outcome.success and outcome.attempts == 1
    kinds = ('right', 'first attempt', 'not written', 'wrong')
    return {kind: found[kind] for kind in kinds} | {'median ticks': float(np.median(ticks))}


def _specimen(name: str, scatter: Scatter, number: int) -> MemoryElement:
    design, settings = preset(name)
    made = scattered(design, scatter, number)
    return new_element(design, settings, driver=Simulation.of(made, settings.time))


def counted(name: str) -> dict[str, Any]:
    """Return the counts of a preset, by fault and by scatter."""
    random = np.random.Generator(np.random.PCG64(SEED))
    element = new_element(preset(name))
    of_reads = {what: reads(element, faults, random) for what, faults in FAULTS.items()}
    of_writes = {'as designed': writes(name, Scatter(), random)}
    for size, kind in itertools.product(SCATTERED, ('alpha', 'k_r')):
        what = f'{kind} scattered by {size:g}'
        of_writes[what] = writes(name, Scatter(**{kind: size}), random)
    return {'count': COUNT, 'reads': of_reads, 'writes': of_writes}


def joined(kept: Mapping[str, Any], name: str, found: Any) -> dict[str, Any]:
    """Return the counts of every preset, and the sum of all reads and writes."""
    presets = kept.get('presets', {}) | {name: found}
    total = Counter[str]()
    for each in presets.values():
        for counts in each['reads'].values():
            total.update(counts)
        for counts in each['writes'].values():
            total.update({'written': counts['right'], 'written wrong': counts['wrong']})
    read = total['right'] + total['undecodable'] + total['wrong']
    return {'all': {'reads': read, **total}, 'presets': presets}


if __name__ == '__main__':
    registers = {
        name: with_reads([name])
        for name, (_, settings) in PRESETS.items()
        if settings.register.spacing and not settings.register.shifted
    }
    sys.exit(run('words', __doc__, counted, SEED, joined, registers))
