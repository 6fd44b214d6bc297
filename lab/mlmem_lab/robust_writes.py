# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Count random writes of the robust elements, made of parts that scatter.

On-site stiffnesses, springs and masses scatter at once, each normally, on elements that were not
used to choose a speed or a limit. Each element has random levels written by its own file's
settings. Only the element with one transducer is calibrated, because it needs its records. A write
is wrong if it is acknowledged while the wall rests farther than 1.5 cells from its level, or a
quarter of J if that is less.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from mlmem import Calibrate, MemoryElement, Outcome, Write, load_element
from mlmem.instrument.drivers import Simulation
from mlmem.physics import Scatter, draw_specimen, find_walls
from mlmem.physics.wall import arrival_tolerance

from .robust_reads import ROBUST_ELEMENTS
from .study import Study


def scatter_parts(name: str, scatter: float, seed: int) -> MemoryElement:
    """Return an element of scattered parts, with the settings of its file."""
    shipped = load_element(name)
    made = draw_specimen(shipped.design, Scatter(alpha=scatter, k_r=scatter, mass=scatter), seed)
    driver = Simulation.build_blank(made, shipped.settings.time)
    return MemoryElement(shipped.design, shipped.settings, driver=driver)


def write_at_random(
    element: MemoryElement, seed: int, count: int
) -> Iterator[tuple[Outcome, bool]]:
    """Write random levels; yield each outcome, and whether the wall rests at the level."""
    design, random = element.design, np.random.default_rng(seed)
    limit = arrival_tolerance(design)
    for level in map(int, random.integers(design.levels, size=count)):
        outcome = element.perform(Write(level))
        sites = [wall.position for wall in find_walls(design, element.chain.configuration)]
        yield outcome, len(sites) == 1 and abs(sites[0] - design.defect_site(level)) <= limit


def count_writes(name: str, seed: int) -> dict[str, Any]:
    """Return the counts of an element by scatter."""
    element_counts = {0.0: 320, 0.01: 320, 0.03: 320, 0.05: 80}
    return {
        f'{scatter:g}': _count_scatter(name, scatter, range(seed, seed + count))
        for scatter, count in element_counts.items()
    }


def _count_scatter(name: str, scatter: float, seeds: range) -> dict[str, Any]:
    right = wrong = failed = refused = 0
    durations, attempts = list[float](), list[int]()
    one_end = load_element(name).settings.has_one_transducer
    if one_end:  # each is calibrated, which takes as long as 20 writes: a quarter is counted
        seeds = seeds[: len(seeds) // 4]
    for seed in seeds:
        element = scatter_parts(name, scatter, seed)
        if one_end and not element.perform(Calibrate()).success:
            refused += 1
            continue
        for outcome, arrived in write_at_random(element, 10_000 + seed, count=16):
            if not outcome.success:
                failed += 1
                continue
            right, wrong = right + arrived, wrong + (not arrived)
            ticks = outcome.end_tick - outcome.start_tick
            durations.append(ticks * element.settings.time.tick)
            attempts.append(outcome.attempts)
    return {
        'writes': right + wrong + failed,
        'right': right,
        'wrong': wrong,
        'failed': failed,
        **({'elements': len(seeds), 'refused elements': refused} if one_end else {}),
        'median duration': float(np.median(durations)),
        'p99 duration': float(np.percentile(durations, 99.0)),
        'mean attempts': round(float(np.mean(attempts)), 3),
    }


robust_writes_study = Study(
    'robust_writes',
    count_writes,
    (*ROBUST_ELEMENTS, 'robust_3_one_end'),
    (
        'lab/mlmem_lab/robust_writes.py',
        *(f'config/{name}.yaml' for name in ROBUST_ELEMENTS),
        'config/robust_3_one_end.yaml',
    ),
    seed=700,
)
