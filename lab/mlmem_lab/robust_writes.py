# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Count random writes of the robust elements, made of parts that scatter.

On-site stiffnesses, springs and masses scatter at once, each normally, on elements that were not
used to choose a speed or a limit. Each element has random levels written by its own file's
settings, without any calibration. A write is wrong if it is acknowledged while the wall rests
farther than 1.5 cells from its level, or a quarter of J if that is less.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mlmem import MemoryElement, Write, load_element
from mlmem.instrument.drivers import Simulation
from mlmem.physics import Scatter, find_walls, scattered
from mlmem.physics.wall import arrival_tolerance

from .study import Study

SEED = 700
ELEMENT_NAMES = ('robust_2', 'robust_3', 'robust_2_friction', 'robust_3_friction')
ELEMENT_COUNTS = {0.0: 320, 0.01: 320, 0.03: 320, 0.05: 80}
"""Elements by scatter."""

WRITES_PER_ELEMENT = 16


def scatter_parts(name: str, scatter: float, seed: int) -> MemoryElement:
    """Return an element of scattered parts, with the settings of its file."""
    shipped = load_element(name)
    made = scattered(shipped.design, Scatter(alpha=scatter, k_r=scatter, mass=scatter), seed)
    driver = Simulation.of(made, shipped.settings.time)
    return MemoryElement(shipped.design, shipped.settings, driver=driver)


def count_writes(name: str) -> dict[str, Any]:
    """Return the counts of an element by scatter."""
    return {f'{scatter:g}': _count_scatter(name, scatter) for scatter in ELEMENT_COUNTS}


def _count_scatter(name: str, scatter: float) -> dict[str, Any]:
    right = wrong = failed = 0
    durations, attempts = list[float](), list[int]()
    for seed in range(SEED, SEED + ELEMENT_COUNTS[scatter]):
        element = scatter_parts(name, scatter, seed)
        design, random = element.design, np.random.default_rng(10_000 + seed)
        for level in map(int, random.integers(design.levels, size=WRITES_PER_ELEMENT)):
            outcome = element.perform(Write(level))
            if not outcome.success:
                failed += 1
                continue
            walls = find_walls(design, element.chain.configuration)
            limit = arrival_tolerance(design)
            arrived = (
                len(walls) == 1 and abs(walls[0].position - design.defect_site(level)) <= limit
            )
            right, wrong = right + arrived, wrong + (not arrived)
            ticks = outcome.end_tick - outcome.start_tick
            durations.append(ticks * element.settings.time.tick)
            attempts.append(outcome.attempts)
    return {
        'writes': right + wrong + failed,
        'right': right,
        'wrong': wrong,
        'failed': failed,
        'median duration': float(np.median(durations)),
        'p99 duration': float(np.percentile(durations, 99.0)),
        'mean attempts': round(float(np.mean(attempts)), 3),
    }


STUDY = Study(
    'robust_writes',
    count_writes,
    ELEMENT_NAMES,
    ('lab/mlmem_lab/robust_writes.py', *(f'config/{name}.yaml' for name in ELEMENT_NAMES)),
    SEED,
)
