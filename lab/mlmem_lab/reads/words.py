# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What many walls bear: python3 -m mlmem_lab.reads.words [COUNT] makes lab/results/words.json.

Random words of the preset `byte` are read with every kind of fault, and written, each from the one
before, on specimens whose alpha or coupling springs scatter. A read is wrong if it succeeds with
another word than that of the true walls, a write if it is acknowledged so. Nothing is discarded.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np

from mlmem_ros.device import Faults, MemoryElement, Read, Write, new_element, preset
from mlmem_ros.device.driver import Simulation
from mlmem_ros.device.register import resting
from mlmem_ros.physics import Specimen
from mlmem_ros.physics.specimen import Scatter, scattered

from ..results import FOLDER, by, save, with_reads
from .count import true_level

NAME, SEED, COUNT = 'byte', 1, 200
FILE = FOLDER / 'words.json'

Rng = np.random.Generator


def _cell(random: Rng) -> int:
    return int(random.integers(2, preset(NAME).design.N))


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

SCATTERED = (0.0, 3e-4, 1e-3, 3e-3)


def reads(faults: Callable[[Rng], Faults], count: int, random: Rng) -> dict[str, int]:
    """Read random words at rest with faults; return how many ended how."""
    element, found = new_element(preset(NAME)), Counter[str]()
    code = element.register.code if element.register else None
    assert code is not None
    for _ in range(count):
        word, given = int(random.integers(code.words)), faults(random)
        element.set_faults(Faults())
        element.chain.place(resting(Specimen(element.design), code.walls(word)))
        element.transducer.assume_rest()
        element.set_faults(given)
        outcome = element.perform(Read())
        element.transducer.release()
        read = outcome.reading.level if outcome.success and outcome.reading else None
        found['undecodable' if read is None else 'right' if read == word else 'wrong'] += 1
    return {name: found[name] for name in ('right', 'undecodable', 'wrong')}


def writes(scatter: Scatter, count: int, random: Rng, specimens: int = 10) -> dict[str, Any]:
    """Write random words in a row on some specimens; return how many ended how."""
    found, ticks = Counter[str](), []
    for number in range(specimens):
        element = _specimen(scatter, number)
        for _ in range(count // specimens):
            word = int(random.integers(element.words))
            outcome = element.perform(Write(word))
            ticks.append(outcome.end_tick - outcome.start_tick)
            true = true_level(element) == word
            found['right' if outcome.success and true else 'not written'] += (
                true or not outcome.success
            )
            found['wrong'] += outcome.success and not true
            found['first attempt'] += outcome.success and outcome.attempts == 1
    names = ('right', 'first attempt', 'not written', 'wrong')
    return {name: found[name] for name in names} | {'median ticks': float(np.median(ticks))}


def _specimen(scatter: Scatter, number: int) -> MemoryElement:
    design, settings = preset(NAME)
    made = scattered(design, scatter, number)
    return new_element(design, settings, driver=Simulation.of(made, settings.time))


def main(arguments: list[str]) -> int:
    """Count, and write the result; return the exit status."""
    count = int(arguments[0]) if arguments else COUNT
    random = np.random.Generator(np.random.PCG64(SEED))
    result: dict[str, Any] = {'count': count, 'reads': {}, 'writes': {}}
    for name, faults in FAULTS.items():
        result['reads'][name] = reads(faults, count, random)
        print(name, result['reads'][name], flush=True)
    for size in SCATTERED:
        kinds = ('alpha', 'k_r') if size else ('alpha',)
        for kind in kinds:
            name = f'{kind} scattered by {size:g}' if size else 'as designed'
            result['writes'][name] = writes(Scatter(**{kind: size}), count, random)
            print(name, result['writes'][name], flush=True)
    total = Counter[str]()
    for each in result['reads'].values():
        total.update(each)
    result['all'] = {'reads': total.total(), **total}
    command = f'python3 -m mlmem_lab.reads.words {count}'
    of = [*with_reads([NAME]), *by(reads, 'reads'), *by(writes, 'writes')]
    save(FILE, result, command, SEED, of)
    return 0


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
