# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The paper's multi-stable potential, amplified by alpha_j: the law of every `Design`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..jit import inlined
from ..potential import Array, Potential, on_site
from .law import OnSite


@inlined
def amplified(constants: tuple[Array, float, float], j: int, y: float) -> tuple[float, float]:
    """Return two factors of alpha_j psi'(y - c)."""
    height, a, b = constants
    return on_site(height[j], y, a, b)


@dataclass(frozen=True, eq=False)
class Multistable(OnSite):
    """The paper's potential.

    Attributes:
        potential: Before amplification.
        alpha: Amplification, one number or shape (n,).
    """

    potential: Potential
    alpha: Array | float = 1.0
    formula = staticmethod(amplified)

    def energy(self, x: ArrayLike) -> Array:
        """Return alpha_j psi."""
        return np.asarray(self.alpha * self.potential.energy(x))

    def slope(self, x: ArrayLike) -> Array:
        """Return alpha_j psi'."""
        return np.asarray(self.alpha * self.potential.slope(x))

    def stiffness(self, x: ArrayLike) -> Array:
        """Return alpha_j psi''."""
        return np.asarray(self.alpha * self.potential.stiffness(x))

    def constants(self, n: int) -> tuple[Any, ...]:
        """Return alpha_j d, a and b."""
        p = self.potential
        return np.broadcast_to(self.alpha * p.d, n).copy(), p.a, p.b

    @property
    def origin(self) -> float:  # type: ignore[override]
        """Return where theta is zero: -c."""
        return -self.potential.c
