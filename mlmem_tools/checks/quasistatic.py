# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a wall does when the strain changes slowly: where it is held, and where it de-pins."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mlmem.errors import StateError
from mlmem.physics.design import Design, stiffness_profile
from mlmem.physics.equilibrium import relax_to_equilibrium, wall_profile
from mlmem.physics.held_wall import hold_walls, make_uniform
from mlmem.physics.specimen import Specimen, as_specimen
from mlmem.physics.values import Array
from mlmem.physics.wall import find_walls

from .excerpt import cut_excerpt

MAX_PINNED_DISTANCE = 3.0
"""A wall farther than this from its defect, in cells, is de-pinned."""


@dataclass(frozen=True)
class Landscape:
    """The energy of a wall by its position, everything else relaxed.

    Attributes:
        X: Positions in sites, shape (m,).
        energy: Shape (m,), less that at the first position.
    """

    X: Array
    energy: Array

    @property
    def slope(self) -> Array:
        """dU/dX at `X`, shape (m,); negative where the wall is pulled to the right."""
        return np.asarray(np.gradient(self.energy, self.X))


def compute_held_landscape(
    made: Design | Specimen, low: float, high: float, strain: float = 0.0
) -> Landscape:
    """Return the landscape of a wall between two positions in sites, under a strain (tension
    positive).

    Raises:
        StateError: No wall can be held there.
    """
    part = cut_excerpt(made, low, high)
    # eight positions per cell show the ripple of the lattice
    X = np.linspace(low, high, 1 + max(2, math.ceil((high - low) * 8)))
    held = hold_walls(part.made, X - part.before, strain * part.strain_shape)
    return Landscape(X, held.energy - held.energy[0])


def compute_lattice_ripple(design: Design) -> Landscape:
    """Return the Peierls-Nabarro potential: the landscape over one cell with gamma = beta = 0.

    Raises:
        StateError: No wall can be held.
    """
    part = cut_excerpt(design, design.J, design.J + 1)
    middle = part.design.N // 2
    flat = make_uniform(part.design)
    X = middle + np.linspace(0.0, 1.0, 33)
    held = hold_walls(flat, X, np.zeros(flat.N))
    return Landscape(X, held.energy - held.energy[0])


def compute_self_energy(design: Design) -> tuple[Array, Array]:
    """Return the energy that a wall gains by straining the substrate under it, over a period.

    The substrate balances the stretch v' of the wall and yields by v' / s: the energy is -1/2 sum
    v'^2 / s, lowest where the substrate is softest. First order in 1 / s.

    Returns:
        Positions X from 0 to J_s in sites and the energy, shape (m,) each.

    Raises:
        StateError: No wall can be held.
    """
    flat = make_uniform(cut_excerpt(design, design.J, design.J + 1).design)
    middle = flat.N // 2
    stretch = np.diff(hold_walls(flat, np.array([middle + 0.5]), np.zeros(flat.N)).v[0])
    offset = np.arange(1.0, flat.N) - middle  # spring j + 1/2 from the wall at middle + 1/2
    X = np.linspace(0.0, design.J_s, 4 * design.J_s + 1)
    s = stiffness_profile(design, X[:, None] + offset - 0.5)
    return X, -0.5 * np.sum(stretch**2 / s, axis=1)


def find_depinning_strain(
    made: Design | Specimen,
    level: int,
    sign: float,
    largest: float,
    *,
    kink: bool = False,
    tolerance: float = 1e-6,
) -> float:
    """Return the strain at which the pinned equilibrium ceases to exist, by continuation.

    Newton's method follows it; when it fails or jumps, the step is halved.

    Args:
        level: Level at whose defect the wall is.
        sign: -1 for compression, +1 for tension.
        largest: Size of the largest strain to try.
        kink: Whether the wall is a kink.
        tolerance: Size of the last step.

    Returns:
        The strain with its sign; NaN if the wall is still pinned at `largest`.

    Raises:
        StateError: The defect holds no wall even without strain.
    """
    made = as_specimen(made)
    design, defect = made.design, made.design.defect_site(level)
    part = cut_excerpt(made, defect - design.J, defect + design.J)
    site = defect - part.before

    def measure_departure(v: Array, V: Array) -> float:
        found = find_walls(part.design, v - V)
        return abs(found[0].position - site) if len(found) == 1 else math.inf

    side = -0.3 if kink else 0.3
    v = wall_profile(part.design, site + side, kink=kink) + part.made.offsets
    v = relax_to_equilibrium(part.made, v, np.zeros_like(v))
    if not measure_departure(v, np.zeros_like(v)) < MAX_PINNED_DISTANCE:
        why = f'the defect at j = {defect} pins no {"kink" if kink else "wall"}'
        raise StateError(reason=why)
    shape, strain, step = sign * part.strain_shape, 0.0, 2e-3
    while step > tolerance:
        if strain + step > largest:
            return math.nan
        V = (strain + step) * shape
        try:
            # a wall that left its pin takes more steps
            trial = relax_to_equilibrium(part.made, v + step * shape, V, iterations=25)
            moved = measure_departure(trial, V)
        except StateError:
            moved = math.inf
        if moved < MAX_PINNED_DISTANCE:
            v, strain = trial, strain + step
        else:
            step /= 2.0
    return sign * strain
