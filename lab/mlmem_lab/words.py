# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Count reads and writes of the words of a register, with faults and scatter.

Random words of a register are read ten times in a row with every kind of fault, and words are
written, each after the one before, on specimens whose alpha or coupling springs scatter. A read is
wrong if it succeeds with another word than that of the true walls, a write if it is acknowledged
so. Nothing is discarded.
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from mlmem import Disturb, Faults, MemoryElement, Read, Write, load_element
from mlmem.instrument.drivers import Simulation
from mlmem.physics import Specimen, StateError, find_walls
from mlmem.physics.equilibrium import DEFECT_OFFSET_CELLS, find_pinned_walls
from mlmem.physics.specimen import Scatter, draw_specimen
from mlmem.readers.reading import UNDECODABLE
from mlmem.readers.register import MAX_LEVEL_OFFSET_CELLS, pin_walls
from mlmem.readers.words import make_code

from .reads.count import READS_PER_MOVE, build_device, reads_study, true_level
from .study import Study, sum_counts

Rng = np.random.Generator


class Trouble(NamedTuple):
    """What a row of reads has to bear.

    Attributes:
        faults: From the start.
        then: From a random tick of every read on.
        shaking: Amplitude of random accelerations of the base, over the harmless one.
    """

    faults: Faults = Faults()
    then: Faults | None = None
    shaking: float = 0.0


Drawing = Callable[[Rng], Trouble]


def define_troubles(cells: int, pulse: float) -> dict[str, Drawing]:
    """Return troubles by name: each draws one.

    Args:
        cells: How many the element has.
        pulse: Amplitude of the pulse of a read, in cells.
    """

    def draw_cell(random: Rng) -> int:
        return int(random.integers(2, cells))

    def scatter_trouble(size: float) -> Drawing:
        return lambda random: Trouble(Faults(disorder_alpha=size, seed=draw_cell(random)))

    def noise_trouble(size: float) -> Drawing:
        return lambda random: Trouble(Faults(sensor_noise=size * pulse, seed=draw_cell(random)))

    return {
        'none': lambda random: Trouble(),
        'half the time step': lambda random: Trouble(),
        'a cell half as stiff': lambda random: Trouble(
            Faults(weak_cell=draw_cell(random), weak_factor=0.5)
        ),
        'a cell of any lower stiffness': lambda random: Trouble(
            Faults(weak_cell=draw_cell(random), weak_factor=float(random.uniform(0.01, 1.0)))
        ),
        'a stuck cell': lambda random: Trouble(Faults(stuck_cell=draw_cell(random))),
        **{f'alpha scattered by {size:g}': scatter_trouble(size) for size in (1e-3, 3e-3, 1e-2)},
        **{f'noise of {size:g} of the pulse': noise_trouble(size) for size in (1e-3, 1e-2)},
        'noise of any size that begins during a read': lambda random: Trouble(
            then=Faults(
                sensor_noise=float(10.0 ** random.uniform(-3.0, 0.0)) * pulse,
                seed=draw_cell(random),
            )
        ),
        'sensors that freeze in 2 % of ticks': lambda random: Trouble(
            Faults(sensor_dropout=0.02, seed=draw_cell(random))
        ),
        'a sensor late by up to 100': lambda random: Trouble(
            Faults(
                sensor_delay=float(random.uniform(0.0, 100.0)),
                sensor_end=str(random.choice(('left', 'right'))),
            )
        ),
        'damping of half to eight times': lambda random: Trouble(
            Faults(damping_factor=float(random.uniform(0.5, 8.0)))
        ),
        'shaking of 0.1 to 10 times the harmless': lambda random: Trouble(
            shaking=float(10.0 ** random.uniform(-1.0, 1.0))
        ),
    }


def count_reads(
    element: MemoryElement, drawing: Drawing, random: Rng, count: int
) -> dict[str, int]:
    """Read random words at rest, each ten times in a row; return how many ended how."""
    found = Counter[str]()
    code = make_code(element.design, element.settings)
    assert code is not None
    while found.total() < count:
        word = int(random.integers(code.words))
        trouble = drawing(random)
        element.set_faults(Faults())
        element.chain.place(pin_walls(Specimen(element.design), code.walls(word)))
        element.transducer.assume_equilibrium()
        element.set_faults(trouble.faults)
        for _ in range(min(READS_PER_MOVE, count - found.total())):
            read = _read_word(element, trouble, random)
            found['undecodable' if read is None else 'right' if read == word else 'wrong'] += 1
        element.apply(Disturb(0.0))
    element.set_faults(Faults())
    return {name: found[name] for name in ('right', 'undecodable', 'wrong')}


def _read_word(element: MemoryElement, trouble: Trouble, random: Rng) -> int | None:
    """Return what a read says, None if that is nothing."""
    steady = trouble.then is None and not trouble.shaking
    begin, harmless = int(random.integers(1, 60)), element.settings.disturbance.safe_limit
    ticks = itertools.count()

    def yield_between() -> None:
        if next(ticks) == begin and trouble.then is not None:
            element.set_faults(trouble.then)
        if trouble.shaking:
            element.apply(Disturb(trouble.shaking * harmless * float(random.uniform(-1.0, 1.0))))

    outcome = element.perform(Read(), None if steady else yield_between)
    element.transducer.release_ends()
    if trouble.then is not None:
        element.set_faults(trouble.faults)
    return outcome.reading.level if outcome.success and outcome.reading else None


def count_reads_between(element: MemoryElement, random: Rng, count: int) -> dict[str, int]:
    """Read words of which one wall, the nearest to a random place or one more, is pinned by the
    lattice at no level, or all rest at levels that no word has: any word is wrong. Return how many
    ended how; none, if a hundred times as many places pin no wall.
    """
    found = Counter[str]()
    design, code = element.design, make_code(element.design, element.settings)
    assert code is not None
    for _ in range(100 * count):
        if found.total() == count:
            break
        at = [
            design.defect_site(level) + DEFECT_OFFSET_CELLS
            for level in code.walls(int(random.integers(code.words)))
        ]
        place = float(random.uniform(design.defect_site(0), design.defect_site(design.levels - 1)))
        if at and random.integers(2):
            at.remove(min(at, key=lambda each: abs(each - place)))
        try:
            v = find_pinned_walls(Specimen(design), [*at, place])
        except StateError:  # nothing pins it there
            continue
        element.chain.place(v)
        if (
            true_level(element, MAX_LEVEL_OFFSET_CELLS) == UNDECODABLE
            and len(find_walls(design, v)) == len(at) + 1
        ):
            read = _read_word(element, Trouble(), random)
            found['undecodable' if read is None else 'wrong'] += 1
    return {name: found[name] for name in ('right', 'undecodable', 'wrong')}


def count_writes(elements: Iterable[MemoryElement], random: Rng, each: int) -> dict[str, Any]:
    """Write so many random words in a row on each of some; return how many ended how."""
    found, ticks = Counter[str](), []
    for element in elements:
        for _ in range(each):
            word = int(random.integers(element.reader.content_count))
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


def make_specimens(name: str, scatter: Scatter) -> Iterator[MemoryElement]:
    """Yield ten elements of a preset that scatter."""
    design, settings = load_element(name).design_and_settings
    for number in range(10):
        made = draw_specimen(design, scatter, number)
        yield MemoryElement(design, settings, driver=Simulation.build_blank(made, settings.time))


def count_preset(name: str, seed: int) -> dict[str, Any]:
    """Return the counts of a preset, by fault and by scatter."""
    random = np.random.Generator(np.random.PCG64(seed))
    element, finer = MemoryElement(load_element(name)), build_device(name, 2)
    kinds = define_troubles(element.design.N, element.settings.register.A)
    # reads of the healthy element, those of every other kind, and writes of an element as designed
    healthy_reads, other_reads, writes = 2000, 2000, 260
    if name == 'register_5':  # each takes long
        other_reads, writes = 500, 60
    of_reads = {
        what: count_reads(
            finer if what == 'half the time step' else element,
            each,
            random,
            healthy_reads if what == 'none' else other_reads,
        )
        for what, each in kinds.items()
    }
    healthy = make_specimens(name, Scatter())
    of_writes = {'as designed': count_writes(healthy, random, writes)}
    scatter_deviations = (3e-4, 1e-3, 3e-3)
    for size, kind in itertools.product(scatter_deviations, ('alpha', 'k_r')):
        what = f'{kind} scattered by {size:g}'
        elements = make_specimens(name, Scatter(**{kind: size}))
        of_writes[what] = count_writes(elements, random, 20)
    apart = np.random.Generator(np.random.PCG64([seed, 1]))
    of_reads['a wall between two levels'] = count_reads_between(build_device(name), apart, 500)
    return {'reads': of_reads, 'writes': of_writes}


def sum_presets(presets: Mapping[str, Any]) -> dict[str, Any]:
    """Return the sum of all reads and writes."""
    total = sum_counts(counts for each in presets.values() for counts in each['reads'].values())
    writes = sum_counts(counts for each in presets.values() for counts in each['writes'].values())
    reads = {name: total[name] for name in ('right', 'undecodable', 'wrong')}
    written = {'written': writes['right'], 'written wrong': writes['wrong']}
    return {'all': {'reads': sum(reads.values()), **reads, **written}}


def count_robust_writes(name: str, seed: int) -> dict[str, Any]:
    """Return the counts of writes of a robust register by scatter of all its parts at once."""
    random = np.random.Generator(np.random.PCG64(seed))
    found = {}
    for scatter in (0.0, 0.01, 0.02, 0.03):
        elements = make_specimens(name, Scatter(alpha=scatter, k_r=scatter, mass=scatter))
        found[f'{scatter:g}'] = count_writes(elements, random, 10)
    return found


words_study = Study(
    'words',
    count_preset,
    ('byte', 'register_4', 'register_5'),
    ('lab/mlmem_lab/words.py', *reads_study.modules),
    1,
    sum_presets,
)

robust_words_study = Study(
    'robust_words',
    count_robust_writes,
    ('robust_words',),
    (*words_study.modules, 'config/robust_words.yaml'),
    seed=11,
)
