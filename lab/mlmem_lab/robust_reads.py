# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Count reads of the robust elements: sound, scattered, with a bad cell, in noise, while shaken.

Every row has an element of its own. A random level is written, then the disturbance begins, and
ten reads in a row follow. A bad cell is bad before the write in every second row, and after it in
the others. A read is wrong if it succeeds and the wall rests farther than 1.5 cells from the
level, or a quarter of J if that is less.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from mlmem import Disturb, Faults, MemoryElement, Read, SetFaults, Write, load_element
from mlmem.instrument.drivers import Simulation, steps_per_tick
from mlmem.physics import Chain, Scatter, Specimen, StateError, draw_specimen

from .one_wire import CELL_FACTORS, break_cell, judge_settled_read, settle_broken
from .reads.count import READS_PER_MOVE, reads_study
from .study import Study

ROBUST_ELEMENTS = ('robust_2', 'robust_3', 'robust_2_friction', 'robust_3_friction')
"""Presets of robust elements with a transducer at either end."""


@dataclass(frozen=True)
class Condition:
    """What is wrong during a row of reads.

    Attributes:
        scatter: Relative standard deviation of alpha, springs and masses.
        finer: Steps in place of one of the device's.
        has_bad_cell: Whether one cell anywhere is bad.
        noise: Standard deviation of the noise of both sensors, relative to the pulse.
        starts_late: Whether the noise begins during each read.
        shaking: Greatest acceleration of the base, relative to the harmless one; each row has its
            own, from 0 on.
        delay: Greatest delay of the signal of one end, in time units; likewise.
    """

    scatter: float = 0.03
    finer: int = 1
    has_bad_cell: bool = False
    noise: float = 0.0
    starts_late: bool = False
    shaking: float = 0.0
    delay: float = 0.0


def define_conditions() -> dict[str, Condition]:
    """Return conditions by name; all but the first two have the scatter that elements stand."""
    return {
        'ideal': Condition(scatter=0.0),
        'scatter 1 %': Condition(scatter=0.01),
        'scatter 3 %': Condition(),
        'half steps': Condition(finer=2),
        'bad cell': Condition(has_bad_cell=True),
        'noise 1 %': Condition(noise=0.01),
        'noise 3 %': Condition(noise=0.03),
        'noise begins': Condition(noise=0.03, starts_late=True),
        'shaking': Condition(shaking=1.0),
        'late sensor': Condition(delay=60.0),
    }


def build_element(name: str, condition: Condition, seed: int) -> MemoryElement:
    """Return a blank element of scattered parts."""
    shipped = load_element(name)
    design, time, scatter = shipped.design, shipped.settings.time, condition.scatter
    made = draw_specimen(design, Scatter(alpha=scatter, k_r=scatter, mass=scatter), seed)
    dt = time.tick / (steps_per_tick(Specimen(design), time) * condition.finer)
    chain = Chain(made, dt)
    return MemoryElement(design, shipped.settings, driver=Simulation(chain))


def _break_any_cell(element: MemoryElement, random: np.random.Generator) -> None:
    kind, site = str(random.choice(list(CELL_FACTORS))), int(random.integers(2, element.design.N))
    settle_broken(element, break_cell(element.chain.specimen, kind, site))


def _make_faults(
    element: MemoryElement, condition: Condition, random: np.random.Generator
) -> Faults:
    """Return the faults of the sensors during a row."""
    noise = condition.noise * element.settings.register.A
    return Faults(
        sensor_noise=0.0 if condition.starts_late else noise,
        sensor_delay=condition.delay * random.uniform(),
        sensor_end=str(random.choice(('left', 'right'))) if condition.delay else 'both',
        seed=int(random.integers(2**31)),
    )


def count_case(case: str, seed: int, count: int = 1250) -> dict[str, Any]:
    """Return how so many reads of a case ended; rounded up to whole rows."""
    name, _, what = case.partition(', ')
    found = Counter[str]()
    first_seed = seed + 10_000 * robust_reads_study.cases.index(case)
    for row in range(math.ceil(count / READS_PER_MOVE)):
        found += _count_row(name, define_conditions()[what], first_seed + row)
    names = ('rows', 'written', 'reads', 'right', 'undecodable', 'wrong', 'stopped')
    return {name: found[name] for name in names}


def _count_row(name: str, condition: Condition, seed: int) -> Counter[str]:
    element, found = build_element(name, condition, seed), Counter[str](rows=1)
    random = np.random.default_rng([seed, 1])
    breaks_late = bool(seed % 2)
    try:
        if condition.has_bad_cell and not breaks_late:
            _break_any_cell(element, random)
        level = int(random.integers(element.design.levels))
        found['written'] += element.perform(Write(level)).success
        if condition.has_bad_cell and breaks_late:
            _break_any_cell(element, random)
        element.apply(SetFaults(_make_faults(element, condition, random)))
        limit = condition.shaking * random.uniform() * element.settings.disturbance.safe_limit
        for _ in range(READS_PER_MOVE):
            outcome = element.perform(Read(), _make_disturbance(element, condition, limit, random))
            if condition.starts_late:
                element.apply(SetFaults(Faults(seed=element.faults.seed)))
            found += Counter(['reads', judge_settled_read(element, outcome)])
    except StateError:  # a cell left its range: the device stops and says so
        found['stopped'] += 1
    return found


def _make_disturbance(
    element: MemoryElement, condition: Condition, limit: float, random: np.random.Generator
) -> Callable[[], object] | None:
    """Return what is done between two ticks of a read, given the greatest acceleration."""
    if condition.shaking:
        return lambda: element.apply(Disturb(limit * random.uniform(-1.0, 1.0)))
    if condition.starts_late:
        ticks = iter(range(10**9))
        begin = int(random.integers(1, 16))
        noise = condition.noise * element.settings.register.A
        noisy = Faults(sensor_noise=noise, seed=element.faults.seed)
        return lambda: next(ticks) == begin and element.apply(SetFaults(noisy))
    return None


robust_reads_study = Study(
    'robust_reads',
    count_case,
    tuple(f'{name}, {what}' for name in ROBUST_ELEMENTS for what in define_conditions()),
    (
        'lab/mlmem_lab/robust_reads.py',
        'lab/mlmem_lab/one_wire.py',
        *reads_study.modules,
        *(f'config/{name}.yaml' for name in ROBUST_ELEMENTS),
    ),
    seed=40_000,
    is_sized=True,
)
