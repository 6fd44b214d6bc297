# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What all laws have in common, and dry friction.

A law is a value. It knows its energy and force for arrays, and its constants, whose type chooses
the scalar formula of its force in the loops (`mlmem_ros.physics.jit.formula`).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

from numpy.typing import ArrayLike

from mlmem_ros.physics.potential import Array


class Law(ABC):
    """An energy of one variable, per cell or per spring."""

    @abstractmethod
    def energy(self, x: ArrayLike) -> Array:
        """Return the energy at x (any shape, or with one law per cell: (..., n))."""

    @abstractmethod
    def slope(self, x: ArrayLike) -> Array:
        """Return its derivative."""


class OnSite(Law):
    """The energy of a cell at configuration D, in a chain of n cells.

    `formulas.on_site(constants, j, y)` returns two factors of cell j's slope at y = D - origin.

    Attributes:
        origin: The configuration from which the loops count.
    """

    origin: float = 0.0

    @abstractmethod
    def constants(self, n: int) -> tuple[Any, ...]:
        """Return what the formula takes, for n cells."""


class Coupling(Law):
    """The energy of a spring between neighbours of extension e; no force at e = 0.

    `formulas.coupling(constants, j, left, x, right)` returns the pull of both springs on cell j
    at x.
    """

    @abstractmethod
    def constants(self) -> tuple[Any, ...]:
        """Return what the formula takes."""


@dataclass(frozen=True)
class Friction:
    """Dry friction, regularised: -force v / sqrt(v^2 + creep^2).

    Attributes:
        force: Its limit.
        creep: Velocity below which it is viscous, above 0. A cell under less than the limit still
            creeps, at less than about this velocity.
    """

    force: float
    creep: float

    def __post_init__(self) -> None:
        if not (self.force >= 0.0 and self.creep > 0.0):
            raise ValueError(
                f'force must be at least 0, creep above 0; got {self.force}, {self.creep}'
            )
