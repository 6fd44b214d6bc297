# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A cell that is held."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .potential import Array


@dataclass(frozen=True)
class HeldCell:
    """A cell held at a prescribed motion for the first sub-steps of a run.

    Attributes:
        site: The driven cell: 1 or N.
        motion: Its displacement and velocity at the first m of the run's `substep_times`, shape
            (2, m); it is free afterwards. PEFRL lets go between two steps only: a step that is
            not held to its end is free from its start.
    """

    site: int
    motion: Array


FREE = HeldCell(1, np.empty((2, 0)))
"""No cell is held."""
