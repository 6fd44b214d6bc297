# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How an element is stepped in time: step size and times, and what moves it in a run: the
substrate's end, a held cell and a shaken base.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import StateError
from .pefrl import MAX_ACCURATE_PHASE, MAX_ACCURATE_STEP, NODES, SUBSTEPS_PER_STEP, limit_step
from .specimen import Material, Specimen, as_specimen
from .values import Array

STABILITY_MARGIN = 0.95
"""Largest fraction of the stability limit to use."""


def highest_frequency(specimen: Specimen, reach: float | None = None) -> float:
    """Return a bound on the angular frequencies of small waves about any state of an element.

    By Gershgorin's circles, with a bound on the on-site stiffness over a cell's range.

    Args:
        reach: Largest |D - origin| of a cell; by default that of the wells of both phases.
    """
    cells, on_site = _bound_cell_frequency(specimen, reach)
    if specimen.design.substrate == 'rigid':
        return math.sqrt(cells)
    substrate = 4.0 * float(specimen.s.max()) + on_site
    return math.sqrt(max(substrate, cells) + on_site / math.sqrt(float(specimen.masses.min())))


def stable_step(material: Material) -> float:
    """Return the largest step that keeps the margin to the limit of stability."""
    return STABILITY_MARGIN * limit_step(highest_frequency(as_specimen(material)))


def default_step(material: Material) -> float:
    """Return the largest step that is both accurate and stable."""
    specimen = as_specimen(material)
    followed = MAX_ACCURATE_PHASE / math.sqrt(_bound_cell_frequency(specimen)[0])
    return min(MAX_ACCURATE_STEP, followed, stable_step(specimen))


def farthest_reach(specimen: Specimen, dt: float) -> float:
    """Return how far a cell may get, as |D - origin|, before a step becomes unstable.

    The farther out, the stiffer the wells. Found by bisection, from below.
    """
    low, high = _well_reach(specimen), 1e6  # bound on |D - origin| where any step is stable
    while high > low * (1.0 + 1e-3):
        middle = math.sqrt(low * high)
        if dt <= limit_step(highest_frequency(specimen, middle)):
            low = middle
        else:
            high = middle
    return low


def _well_reach(specimen: Specimen) -> float:
    """Return the largest |D - origin| in the wells of both phases."""
    return max(abs(edge - specimen.potential.origin) for edge in specimen.design.wells)


def _bound_cell_frequency(specimen: Specimen, reach: float | None = None) -> tuple[float, float]:
    """Return the greatest square of a cell's frequency, and the on-site stiffness in it."""
    stiffest = specimen.potential.max_stiffness(_well_reach(specimen) if reach is None else reach)
    on_site = stiffest * float(specimen.alpha.max())
    return (2.0 * float(specimen.coupling_stiffness.max()) + on_site) / float(
        specimen.masses.min()
    ), on_site


def substep_times(
    steps: int, dt: float, first: int = 0, nodes: tuple[float, ...] = NODES
) -> Array:
    """Return the times in a run of steps at which the prescribed motion is needed.

    Args:
        dt: Step size in time units.
        first: Number of the first step.
        nodes: These times in a step, as fractions of it; by default those of a chain.

    Returns:
        Times from the start of step 0, rising, shape (m steps,) with m nodes.
    """
    starts = first + np.arange(steps, dtype=np.float64)
    return np.asarray((starts[:, None] + np.array(nodes)).ravel() * dt)


@dataclass(frozen=True)
class HeldCell:
    """A cell held at a prescribed motion for the first sub-steps of a run.

    Attributes:
        site: The driven cell: 1 or N.
        motion: Its displacement and velocity at the first m of the run's `substep_times`, shape
            (2, m); it is free afterwards. A chain lets go between two steps only: a step that is
            not held to its end is free from its start.
    """

    site: int
    motion: Array


NO_HELD_CELL = HeldCell(1, np.empty((2, 0)))
"""No cell is held."""


def copy_contiguous(array: Array) -> Array:
    """Return a contiguous, writeable copy: the one kind the kernels are compiled for."""
    return np.array(array, dtype=np.float64, order='C')


def require_finite(field: str, values: ArrayLike, shape: tuple[int, ...]) -> None:
    """Raise `StateError` unless these are finite numbers of a shape; () stands for one number."""
    if np.shape(values) != shape:
        raise StateError.out_of_range(field, np.shape(values), f'of shape {shape}')
    if not np.isfinite(values).all():
        raise StateError.out_of_range(field, 'NaN or infinity', 'finite')


class Inputs(NamedTuple):
    """The inputs of a run, at the `substep_times` of its steps.

    Attributes:
        V_N: Displacement of the substrate's end, shape (m,).
        held_cell: A cell held at a prescribed motion at the start of the run.
        shake: Acceleration of the base, shape (m,).
    """

    V_N: Array
    held_cell: HeldCell
    shake: Array

    @classmethod
    def from_arguments(
        cls, V_N: Array, held_cell: HeldCell | None, shake: Array | None, N: int
    ) -> Inputs:
        """Return the inputs of a run, for the arguments of `Chain.advance`.

        Args:
            N: Number of cells.

        Raises:
            StateError: They have the wrong shape, are not finite, or not of whole steps.
        """
        V_N = copy_contiguous(V_N)
        if V_N.ndim != 1 or len(V_N) % SUBSTEPS_PER_STEP:
            expected = f'of shape ({SUBSTEPS_PER_STEP} steps,)'
            raise StateError.out_of_range('V_N', V_N.shape, expected)
        require_finite('V_N', V_N, V_N.shape)
        base = np.zeros(len(V_N))
        if shake is not None:
            require_finite('shake', shake, V_N.shape)
            base = copy_contiguous(shake)
        if held_cell is None:
            return cls(V_N, NO_HELD_CELL, base)
        site, motion = held_cell.site, held_cell.motion
        if site not in (1, N):
            raise StateError.out_of_range('site', site, f'1 or N = {N}')
        if motion.ndim != 2 or motion.shape[0] != 2:
            raise StateError.out_of_range('motion', motion.shape, 'of shape (2, m)')
        if motion.shape[1] > len(V_N):
            expected = f'at most the {len(V_N)} sub-steps of the run'
            raise StateError.out_of_range('motion', motion.shape[1], expected)
        require_finite('motion', motion, motion.shape)
        return cls(V_N, held_cell, base)

    def skip_substeps(self, done: int) -> Inputs:
        """Return those that come after some sub-steps."""
        held_cell = HeldCell(self.held_cell.site, self.held_cell.motion[:, done:])
        return Inputs(self.V_N[done:], held_cell, self.shake[done:])

    def count_still_substeps(self, V_N: float) -> int:
        """Return for how many sub-steps nothing moves whose substrate's end is at V_N."""
        if self.held_cell.motion.size:
            return 0
        moved: NDArray[np.bool_] = (self.V_N != V_N) | (self.shake != 0.0)
        return int(moved.argmax()) if moved.any() else len(moved)


NO_INPUTS = Inputs(np.empty(0), NO_HELD_CELL, np.empty(0))
"""The inputs of a run of no steps."""
