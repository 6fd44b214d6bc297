# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One actual element of a design: what scatter, wear and faults do to its cells."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..errors import DesignError
from ..rng import RandomStream, make_generator
from .curve import Curve
from .design import EXPECTED_MATERIAL, Design, as_design, strain_shape
from .potential import Potential
from .values import Array
from .wall import barrier_height

MAX_OFFSET = 0.5
"""Largest accepted shift of a cell's ground states, in lattice constants."""

MAX_DEPTH = 0.5
"""Largest accepted difference of a cell's two wells, relative to the barrier."""


@dataclass(frozen=True, eq=False)
class Specimen:
    """An element as manufactured or changed since; by default exactly as designed.

    Arrays hold site j at index j - 1, the spring j + 1/2 at index j - 1. A number stands for
    an array of it.

    Attributes:
        design: The intended element.
        alpha_factor: Amplification alpha_j over the design's, shape (N,), above 0.
        k_r_factor: Stiffness of the springs between the metamaterial's cells over k_r, shape
            (N - 1,), above 0.
        s_factor: Substrate stiffness over the design's, shape (N - 1,), above 0.
        mass: Masses of the metamaterial's cells in m, shape (N,), above 0.
        offset: Shift of a cell's ground states in lattice constants, shape (N,).
        depth: How much deeper the active well of a cell is than the inactive one, over the barrier
            between them where alpha is 1, shape (N,); only over a rigid substrate. A constant
            force on the cell makes the difference.
        eta_factor: Damping over the design's, at least 0.
        stuck: Sites of the cells that stick to the substrate under them, from 2 to N - 1: their
            configuration v - V does not change.
        damped_by_substrate: Whether damping acts on v - V, as in cells that the substrate damps,
            instead of v; only over a rigid substrate.

    Raises:
        DesignError: A wrong shape, or a value that is out of range.
    """

    design: Design
    alpha_factor: float | Array = 1.0
    k_r_factor: float | Array = 1.0
    s_factor: float | Array = 1.0
    mass: float | Array = 1.0
    offset: float | Array = 0.0
    depth: float | Array = 0.0
    eta_factor: float = 1.0
    damped_by_substrate: bool = False
    stuck: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        if not isinstance(self.design, Design):
            raise DesignError.out_of_range('design', self.design, 'a Design')
        n = self.design.N
        sizes = {
            'alpha_factor': n, 'k_r_factor': n - 1, 's_factor': n - 1, 'mass': n, 'offset': n,
            'depth': n,
        }  # fmt: skip
        for name, size in sizes.items():
            given = np.array(getattr(self, name), dtype=np.float64)  # a private copy
            if given.shape not in ((), (size,)):
                raise DesignError.out_of_range(name, given.shape, f'of shape ({size},)')
            object.__setattr__(self, name, np.broadcast_to(given, size))
        for name in ('alpha_factor', 'k_r_factor', 's_factor', 'mass'):
            values = getattr(self, name)
            right = (values > 0.0) & np.isfinite(values)
            _require_everywhere(name, values, right, 'above 0 and finite')
        object.__setattr__(self, 'stuck', tuple(sorted(set(self.stuck))))
        if not all(1 < site < n for site in self.stuck):
            raise DesignError.out_of_range('stuck', self.stuck, f'cells from 2 to {n - 1}')
        for name, most in (('offset', MAX_OFFSET), ('depth', MAX_DEPTH)):
            values = getattr(self, name)
            right = np.abs(values) <= most  # false for NaN
            _require_everywhere(name, values, right, f'from {-most} to {most}')
        if self.depths.any() and self.design.substrate != 'rigid':
            worst = float(np.abs(self.depths).max())
            raise DesignError.out_of_range('depth', worst, '0 over an elastic substrate')
        if not 0.0 <= self.eta_factor < np.inf:
            raise DesignError.out_of_range('eta_factor', self.eta_factor, 'at least 0')
        if self.damped_by_substrate and self.design.substrate != 'rigid':
            raise DesignError.out_of_range(
                'damped_by_substrate', True, 'false for an elastic substrate'
            )

    def __repr__(self) -> str:
        deviation = 'as designed' if self.is_ideal else 'with deviations'
        return f'Specimen({self.design.N} cells, {deviation})'

    @property
    def is_ideal(self) -> bool:
        """Whether it is exactly as designed."""
        ideal = Specimen(self.design)
        return all(
            np.array_equal(getattr(self, each.name), getattr(ideal, each.name))
            for each in fields(self)
        )

    # --- as the functions of the material use it ------------------------------------------

    @cached_property
    def stuck_indices(self) -> NDArray[np.int64]:
        """Indices of the stuck cells."""
        return np.array(self.stuck, dtype=np.int64) - 1

    @property
    def masses(self) -> Array:
        """Masses, shape (N,)."""
        return np.asarray(self.mass)

    @property
    def offsets(self) -> Array:
        """Shifts of the ground states, shape (N,)."""
        return np.asarray(self.offset)

    @property
    def depths(self) -> Array:
        """By how much active wells are deeper, relative to the barrier, shape (N,)."""
        return np.asarray(self.depth)

    @cached_property
    def depth_force(self) -> Array:
        """The constant force on every cell that makes its wells unequal, shape (N,)."""
        step = self.design.D_s2 - self.design.D_s1
        return np.asarray(self.depths * barrier_height(self.design) / step)

    @property
    def potential(self) -> Potential | Curve:
        """The on-site potential, before amplification and shift."""
        return self.design.potential

    @cached_property
    def alpha(self) -> Array:
        """Amplification of the on-site potential, shape (N,)."""
        return np.asarray(self.design.alpha * self.alpha_factor)

    @property
    def k_r(self) -> Array:
        """Stiffness of the springs between the metamaterial's cells, shape (N - 1,)."""
        return np.asarray(self.k_r_factor)

    @property
    def springs(self) -> tuple[Array, ...]:
        """These springs as the loops take them: nothing where all are k_r; `depth_force` follows
        where wells are unequal.
        """
        stiffness = np.concatenate(([0.0], self.k_r, [0.0]))
        if self.depths.any():
            return stiffness, self.depth_force
        return () if (self.k_r == 1.0).all() else (stiffness,)

    @cached_property
    def coupling_stiffness(self) -> Array:
        """Stiffness of both such springs of a cell, shape (N,); at an end that of its one, twice:
        a ghost cell that repeats its neighbour is tied there.
        """
        return np.asarray(np.pad(self.k_r, (1, 0), 'edge') + np.pad(self.k_r, (0, 1), 'edge'))

    @cached_property
    def s(self) -> Array:
        """Substrate stiffness, shape (N - 1,)."""
        return np.asarray(self.design.s * self.s_factor)

    @property
    def eta(self) -> float:
        """On-site viscous damping."""
        return self.design.eta * self.eta_factor

    @cached_property
    def strain_shape(self) -> Array:
        """Quasi-static substrate displacement V_j for a unit V_N (V_1 = 0), shape (N,)."""
        return strain_shape(self.s)


class HasSpecimen(Protocol):
    """What is made of a specimen: a loaded element, a chain or a trajectory."""

    @property
    def specimen(self) -> Specimen:
        """The specimen."""


Material = Design | Specimen | HasSpecimen
"""What the functions of the material take: all that `as_specimen` accepts."""


def as_specimen(material: Material) -> Specimen:
    """Return the specimen of a material; that of a design is exactly as designed.

    Raises:
        DesignError: It is no material.
    """
    if isinstance(material, Design):
        return Specimen(material)
    specimen = getattr(material, 'specimen', material)
    if not isinstance(specimen, Specimen):
        raise DesignError.out_of_range('material', material, EXPECTED_MATERIAL)
    return specimen


@dataclass(frozen=True)
class Scatter:
    """Standard deviations of fabrication scatter, normally distributed.

    Attributes:
        alpha: Of the on-site amplification, relative.
        k_r: Of the springs between the metamaterial's cells, relative.
        s: Of the substrate stiffness, relative.
        mass: Of the masses, relative.
        offset: Of the ground states, in lattice constants.
        depth: Of the difference of a cell's two wells, relative to the barrier.

    Raises:
        DesignError: One is below 0.
    """

    alpha: float = 0.0
    k_r: float = 0.0
    s: float = 0.0
    mass: float = 0.0
    offset: float = 0.0
    depth: float = 0.0

    def __post_init__(self) -> None:
        for each in fields(self):
            if not (deviation := getattr(self, each.name)) >= 0.0:
                raise DesignError.out_of_range(each.name, deviation, 'at least 0')


def draw_specimen(material: Material, scatter: Scatter, seed: int) -> Specimen:
    """Return a random element of a design; the same seed gives the same element.

    Every quantity has its own random stream, so that one scatter does not change the others'
    values for the same seed.
    """
    names = 'ALPHA', 'K_R', 'S', 'MASS', 'OFFSET', 'DEPTH'
    alpha, k_r, s, mass, offset, depth = (
        make_generator(seed, RandomStream[name]) for name in names
    )

    def draw_factors(generator: np.random.Generator, deviation: float, size: int) -> Array:
        # no stiffness can be below zero
        return np.maximum(1.0 + deviation * generator.standard_normal(size), 0.05)

    design = as_design(material)
    n = design.N
    return Specimen(
        design,
        alpha_factor=draw_factors(alpha, scatter.alpha, n),
        k_r_factor=draw_factors(k_r, scatter.k_r, n - 1),
        s_factor=draw_factors(s, scatter.s, n - 1),
        mass=draw_factors(mass, scatter.mass, n),
        offset=np.clip(scatter.offset * offset.standard_normal(n), -MAX_OFFSET, MAX_OFFSET),
        depth=np.clip(scatter.depth * depth.standard_normal(n), -MAX_DEPTH, MAX_DEPTH),
    )


def _require_everywhere(name: str, values: Array, right: NDArray[np.bool_], what: str) -> None:
    """Raise `DesignError` for the first cell or spring whose value is not right."""
    if not right.all():
        first = int(np.argmin(right))
        raise DesignError.out_of_range(name, float(values[first]), f'{what} (at {first + 1})')
