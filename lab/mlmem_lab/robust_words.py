# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Count random words that kicks write into a robust register and take out again.

On-site stiffnesses, springs and masses scatter at once, on elements that chose no speed. Each word
follows the one before. A write is wrong if it is acknowledged with other walls than those of its
word.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mlmem.physics.specimen import Scatter

from .study import Study
from .words import count_writes, make_specimens

SEED = 11
SCATTERS = (0.0, 0.01, 0.02, 0.03)
WRITES_PER_ELEMENT = 10


def count_scatters(name: str) -> dict[str, Any]:
    """Return the counts of a register by scatter."""
    random = np.random.Generator(np.random.PCG64(SEED))
    found = {}
    for scatter in SCATTERS:
        elements = make_specimens(name, Scatter(alpha=scatter, k_r=scatter, mass=scatter))
        found[f'{scatter:g}'] = count_writes(elements, random, WRITES_PER_ELEMENT)
    return found


STUDY = Study(
    'robust_words',
    count_scatters,
    ('robust_words',),
    ('lab/mlmem_lab/robust_words.py', 'lab/mlmem_lab/words.py', 'config/robust_words.yaml'),
    SEED,
)
