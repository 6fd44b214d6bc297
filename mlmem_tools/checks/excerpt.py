# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A few cells cut out of an element, around a wall.

A wall is a few cells wide, and the strain around it decays over as many, so its equilibria do not
need the thousands of cells of a large element.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np

from mlmem.physics import Design, DesignError, Material, Specimen, StateError, as_specimen
from mlmem.physics.values import Array


@dataclass(frozen=True)
class Excerpt:
    """Consecutive cells of an element.

    Attributes:
        made: These cells as an element of their own, with the same alpha, k_r and s.
        before: Number of cells left out at the left: site j of the element is j - before here.
        strain_shape: Substrate displacement of every cell for a unit strain of the whole
            element, shape (n,), from that in the middle.
    """

    made: Specimen
    before: int
    strain_shape: Array

    @property
    def design(self) -> Design:
        """Their design."""
        return self.made.design


def cut_excerpt(material: Material, low: float, high: float) -> Excerpt:
    """Return the cells from `low` to `high`, which a wall will visit, and those around them that
    affect it there.

    Raises:
        StateError: They are not a valid element on their own.
    """
    made = as_specimen(material)
    design, margin = made.design, decay_reach(made.design)
    # Whole levels are left out, so that the defects stay at the multiples of J.
    before = max(0, math.floor((low - margin) / design.J) * design.J)
    before = min(before, (design.N - design.tail - 2) // design.J * design.J - design.J)
    before = max(0, before)
    last = min(design.N, max(math.ceil(high + margin), before + design.J + 1))
    # (1 + gamma (j + before)) is (1 + gamma before) (1 + gamma' j).
    scale = 1.0 + design.gamma * before
    try:
        part = dataclasses.replace(
            design, N=last - before, gamma=design.gamma / scale, d=design.d * scale,
            j_0=(design.j_0 - before) % design.J_s, tail=max(0, last - (design.N - design.tail)),
        )  # fmt: skip
    except DesignError as error:  # with a gradient so steep that alpha is many times 1
        place = f'the cells about {low:g} are not a valid element'
        raise StateError.of_error(error, place=place) from error
    cells = slice(before, last)
    alpha_factor = np.asarray(made.alpha_factor)[cells]
    if design.rise:  # the part has another last level
        alpha_factor = made.alpha[cells] / (part.alpha * scale)
    own = Specimen(
        part,
        alpha_factor,
        made.k_r[before : last - 1],
        np.asarray(made.s_factor)[before : last - 1],
        made.masses[cells],
        made.offsets[cells],
        made.depths[cells],
        made.eta_factor,
        stuck=tuple(site - before for site in made.stuck if 1 < site - before < last - before),
    )
    shape = design.end_displacement(1.0) * made.strain_shape[cells]
    return Excerpt(own, before, shape - shape[len(shape) // 2])


def decay_reach(design: Design) -> int:
    """Return within how many cells, N at most, a static displacement decays by exp(-12)."""
    softest = min(design.k_s1, design.k_s2) * float(design.alpha.min())
    decay = 2.0 * math.asinh(0.5 * math.sqrt(softest))  # acosh(1 + k / 2), however small k is
    return min(design.N, math.ceil(12.0 / decay))
