# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How an element is stepped in time: method, step size and times."""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np

from .methods import NOH_BATHE, Integrator
from .potential import Array
from .specimen import Specimen

STABILITY_MARGIN = 0.95
"""Largest fraction of the stability limit to use."""

FARTHEST = 1e6
"""Bound on a cell's |D - origin| if any step is stable."""


def highest_frequency(specimen: Specimen, reach: float | None = None) -> float:
    """Return a bound on the angular frequencies of small waves about any state of an element.

    By Gershgorin's circles, with a bound on the on-site stiffness over a cell's range.

    Args:
        reach: Largest |D - origin| of a cell; by default that of the wells of both phases.
    """
    cells, on_site = _cells(specimen, reach)
    if specimen.design.substrate == 'rigid':
        return math.sqrt(cells)
    substrate = 4.0 * float(specimen.s.max()) + on_site
    return math.sqrt(max(substrate, cells) + on_site / math.sqrt(float(specimen.masses.min())))


def stable_step(specimen: Specimen, integrator: Integrator = NOH_BATHE) -> float:
    """Return the largest step that keeps the margin to the limit of the integrator."""
    return STABILITY_MARGIN * _limit(specimen, integrator)


def default_step(specimen: Specimen, integrator: Integrator = NOH_BATHE) -> float:
    """Return the largest step that is both accurate and stable."""
    followed = integrator.accurate_turn / math.sqrt(_cells(specimen)[0])
    return min(integrator.accurate_step, followed, stable_step(specimen, integrator))


def farthest_reach(specimen: Specimen, integrator: Integrator, dt: float) -> float:
    """Return how far a cell may get, as |D - origin|, before a step becomes unstable.

    The farther out, the stiffer the wells. Found by bisection, from below.
    """
    low, high = _wells(specimen), FARTHEST
    while high > low * (1.0 + 1e-3):
        middle = math.sqrt(low * high)
        if dt <= _limit(specimen, integrator, middle):
            low = middle
        else:
            high = middle
    return low


def _wells(specimen: Specimen) -> float:
    """Return the largest |D - origin| in the wells of both phases."""
    return max(abs(edge - specimen.potential.origin) for edge in specimen.design.wells)


def _cells(specimen: Specimen, reach: float | None = None) -> tuple[float, float]:
    """Return the greatest square of a cell's frequency, and the on-site stiffness in it."""
    stiffest = specimen.potential.stiffest(_wells(specimen) if reach is None else reach)
    on_site = stiffest * float(specimen.alpha.max())
    return (2.0 * float(specimen.tied.max()) + on_site) / float(specimen.masses.min()), on_site


def _limit(specimen: Specimen, integrator: Integrator, reach: float | None = None) -> float:
    eta = specimen.eta / float(specimen.masses.min())
    return integrator.limit(highest_frequency(specimen, reach), eta)


class Nodes(Protocol):
    """Whatever needs the prescribed motion at times in every step: an integrator, a driver."""

    @property
    def nodes(self) -> tuple[float, ...]:
        """These times, as fractions of the step."""


def substep_times(steps: int, dt: float, asker: Nodes = NOH_BATHE, first: int = 0) -> Array:
    """Return the times in a run of steps at which the prescribed motion is needed.

    Args:
        dt: Step size in time units.
        asker: Its nodes follow each other in every step.
        first: Number of the first step.

    Returns:
        Times from the start of step 0, rising, shape (m steps,) with m nodes.
    """
    starts = first + np.arange(steps, dtype=np.float64)
    return np.asarray((starts[:, None] + np.array(asker.nodes)).ravel() * dt)
