# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How an element is stepped in time: by which method, how far at once, and at which times."""

from __future__ import annotations

import math

import numpy as np

from .design import Design
from .integrator import Integrator
from .jit import in_cache
from .noh_bathe import NOH_BATHE
from .pefrl import PEFRL
from .potential import Array
from .specimen import Specimen

STABILITY_MARGIN = 0.95
"""Largest share of the stability limit that we step with."""

INTEGRATORS: dict[str, Integrator] = {each.name: each for each in (NOH_BATHE, PEFRL)}
"""The methods by name."""


def kernel_in_cache(design: Design, integrator: Integrator = NOH_BATHE) -> bool:
    """Return whether the loop that advances a design is compiled already; see `jit.in_cache`."""
    return in_cache(integrator.rigid if design.substrate == 'rigid' else integrator.elastic)


def highest_frequency(element: Design | Specimen) -> float:
    """Return a bound of the angular frequencies of small waves anywhere in an element."""
    specimen = element if isinstance(element, Specimen) else Specimen(element)
    design, lightest = specimen.design, float(specimen.masses.min())
    between = np.linspace(design.D_s1 - 0.25, design.D_s2 + 0.25, 1001)
    on_site = float(np.abs(design.potential.stiffness(between)).max() * specimen.alpha.max())
    metamaterial = (4.0 + on_site) / lightest
    if design.substrate == 'rigid':
        return math.sqrt(metamaterial)
    stiffest = 4.0 * float(specimen.s.max()) + on_site
    return math.sqrt(max(stiffest, metamaterial) + on_site / math.sqrt(lightest))


def stable_step(element: Design | Specimen, integrator: Integrator = NOH_BATHE) -> float:
    """Return the largest step that keeps the margin to the limit of the integrator."""
    specimen = element if isinstance(element, Specimen) else Specimen(element)
    eta = specimen.eta / float(specimen.masses.min())
    return STABILITY_MARGIN * integrator.limit(highest_frequency(specimen), eta)


def default_step(element: Design | Specimen, integrator: Integrator = NOH_BATHE) -> float:
    """Return the largest step that is both accurate and stable."""
    return min(integrator.accurate_step, stable_step(element, integrator))


def substep_times(
    steps: int, dt: float, integrator: Integrator = NOH_BATHE, first: int = 0
) -> Array:
    """Return the times in a run of steps at which the integrator asks for what is prescribed.

    Args:
        steps: Number of steps.
        dt: Step size in time units.
        integrator: The method; its nodes follow each other in every step.
        first: Number of the first step.

    Returns:
        Times from the start of step 0, rising, shape (m steps,) with m = integrator.substeps.
    """
    starts = first + np.arange(steps, dtype=np.float64)
    return np.asarray((starts[:, None] + np.array(integrator.nodes)).ravel() * dt)
