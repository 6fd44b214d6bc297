# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What moves a chain in a run: the substrate's end, a held cell and a shaken base."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .errors import StateError
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


class Inputs(NamedTuple):
    """The inputs of a run, at the `substep_times` of its steps.

    Attributes:
        V_N: Displacement of the substrate's end, shape (m,).
        held_cell: A cell held at a prescribed motion at the start of the run.
        shake: Acceleration of the base, shape (m,); None for a base at rest.
    """

    V_N: Array
    held_cell: HeldCell | None = None
    shake: Array | None = None

    def check(self, N: int, substeps: int) -> None:
        """Raise `StateError` unless they are inputs of a chain of N cells, in whole steps."""
        V_N, held_cell, shake = self
        if V_N.ndim != 1 or len(V_N) % substeps:
            raise StateError(f'V_N must have shape ({substeps} steps,); got {V_N.shape}')
        if not np.isfinite(V_N).all():
            raise StateError('V_N must be finite; got NaN or infinity')
        if shake is not None and not (shake.shape == V_N.shape and np.isfinite(shake).all()):
            raise StateError(f'shake must have shape {V_N.shape} and be finite')
        if held_cell is None:
            return
        if held_cell.site not in (1, N):
            raise StateError(f'site must be 1 or N = {N}; got {held_cell.site}')
        motion = held_cell.motion
        if motion.ndim != 2 or motion.shape[0] != 2:
            raise StateError(f'motion must have shape (2, m); got {motion.shape}')
        if motion.shape[1] > len(V_N):
            raise StateError(
                f'motion must end with the run, {len(V_N)} sub-steps; got {motion.shape[1]}'
            )
        if not np.isfinite(motion).all():
            raise StateError('motion must be finite; got NaN or infinity')

    def after(self, done: int) -> Inputs:
        """Return those that come after some sub-steps."""
        V_N, held_cell, shake = self
        if held_cell is not None:
            held_cell = HeldCell(held_cell.site, held_cell.motion[:, done:])
        return Inputs(V_N[done:], held_cell, None if shake is None else shake[done:])

    def still(self, V_N: float) -> int:
        """Return for how many sub-steps nothing moves whose substrate's end is at V_N."""
        if self.held_cell is not None and self.held_cell.motion.size:
            return 0
        moved: NDArray[np.bool_] = self.V_N != V_N
        if self.shake is not None:
            moved |= self.shake != 0.0
        return int(moved.argmax()) if moved.any() else len(moved)
