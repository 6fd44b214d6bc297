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
from mlmem.physics import Scatter, scattered

from .robust_writes import write_at_random
from .study import Study

SEED = 900
SCATTER = 0.03
ELEMENT_COUNT = 40
WRITES_PER_ELEMENT = 8

LOSSES = {
    'robust_2': ('eta',), 'robust_3': ('eta',),
    'robust_2_friction': ('friction', 'eta'), 'robust_3_friction': ('friction', 'eta'),
}  # fmt: skip
"""What is changed in the design, by element."""

FACTORS = (0.8, 1.2)
"""How many times as great it is."""


def count_writes(case: str) -> dict[str, Any]:
    """Return the counts of a case such as `robust_2, eta 0.8`."""
    name, loss = case.split(', ')
    key, factor = loss.split()
    shipped = load_element(name)
    other = replace(shipped.design, **{key: float(factor) * getattr(shipped.design, key)})
    counts = dict.fromkeys(('writes', 'right', 'wrong', 'failed', 'failed calibrations'), 0)
    for seed in range(SEED, SEED + ELEMENT_COUNT):
        made = scattered(other, Scatter(alpha=SCATTER, k_r=SCATTER, mass=SCATTER), seed)
        driver = Simulation.of(made, shipped.settings.time)
        element = MemoryElement(shipped.design, shipped.settings, driver=driver)
        counts['failed calibrations'] += not element.perform(Calibrate()).success
        for outcome, arrived in write_at_random(element, 10_000 + seed, WRITES_PER_ELEMENT):
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
        for name, keys in LOSSES.items()
        for key in keys
        for factor in FACTORS
    ),
    (
        'lab/mlmem_lab/robust_losses.py', 'lab/mlmem_lab/robust_writes.py',
        *(f'config/{name}.yaml' for name in LOSSES),
    ),
    SEED,
)  # fmt: skip
