# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Count random writes of robust elements whose damping or friction is not that of the design.

The elements scatter by 3 %, as in `robust_writes`, and each is calibrated once, which finds one
factor on its losses and one on the speeds of its kicks. It is then written, calibrated or not.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from mlmem import Calibrate, MemoryElement, load_element
from mlmem.instrument.drivers import Simulation
from mlmem.physics import Scatter, draw_specimen

from .robust_reads import ROBUST_ELEMENTS
from .robust_writes import write_at_random
from .study import Study


def count_writes(case: str, seed: int) -> dict[str, Any]:
    """Return the counts of a case such as `robust_2, eta 0.8`, over 40 elements."""
    name, loss = case.split(', ')
    key, factor = loss.split()
    shipped = load_element(name)
    other = replace(shipped.design, **{key: float(factor) * getattr(shipped.design, key)})
    counts = dict.fromkeys(('writes', 'right', 'wrong', 'failed', 'failed calibrations'), 0)
    for own_seed in range(seed, seed + 40):
        made = draw_specimen(other, Scatter(alpha=0.03, k_r=0.03, mass=0.03), own_seed)
        driver = Simulation.build_blank(made, shipped.settings.time)
        element = MemoryElement(shipped.design, shipped.settings, driver=driver)
        counts['failed calibrations'] += not element.perform(Calibrate()).success
        for outcome, arrived in write_at_random(element, 10_000 + own_seed, count=8):
            counts['writes'] += 1
            counts['failed'] += not outcome.success
            counts['right'] += outcome.success and arrived
            counts['wrong'] += outcome.success and not arrived
    return {'element': name, 'loss': key, 'factor': float(factor), **counts}


robust_losses_study = Study(
    'robust_losses',
    count_writes,
    tuple(
        f'{name}, {key} {factor}'
        for name in ROBUST_ELEMENTS
        for key in ('friction', 'eta')
        for factor in (0.8, 1.2)
        if key == 'eta' or name.endswith('friction')
    ),
    (
        'lab/mlmem_lab/robust_losses.py', 'lab/mlmem_lab/robust_writes.py',
        *(f'config/{name}.yaml' for name in ROBUST_ELEMENTS),
    ),
    seed=900,
)  # fmt: skip
