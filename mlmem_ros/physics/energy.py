# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Energy of the two chains and the forces that derive from it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from .design import Design
from .potential import Array
from .specimen import Specimen

if TYPE_CHECKING:
    from .chain import Chain


@dataclass(frozen=True)
class Energy:
    """Where the energy of a chain is, in k_r (lattice constant)^2.

    Attributes:
        kinetic: Of all masses; the quasi-static substrate of the rigid model has none.
        coupling: In the springs between metamaterial cells.
        on_site: In the multi-stable springs.
        substrate: In the substrate's springs.
    """

    kinetic: float
    coupling: float
    on_site: float
    substrate: float

    @property
    def total(self) -> float:
        """The sum of all parts."""
        return self.kinetic + self.coupling + self.on_site + self.substrate


def energy(chain: Chain) -> Energy:
    """Return the energy of a chain's present state."""
    free = np.isfinite(chain.specimen.masses)  # a stuck cell does not move
    motion = float(np.sum(chain.specimen.masses[free] * chain.velocity[free] ** 2))
    motion += float(np.sum(chain.substrate_velocity**2))
    coupling, on_site, substrate = _potential_parts(chain.specimen, chain.v, chain.V)
    return Energy(0.5 * motion, coupling, on_site, substrate)


def potential_energy(material: Design | Specimen, v: Array, V: Array) -> float:
    """Return the energy of displacements v, V at rest, both of shape (N,)."""
    return sum(_potential_parts(material, v, V))


def _potential_parts(
    material: Design | Specimen, v: Array, V: Array
) -> tuple[float, float, float]:
    return (
        0.5 * float(np.sum(np.diff(v) ** 2)),
        float(np.sum(material.alpha * material.potential.energy(v - (V + material.offsets)))),
        0.5 * float(np.sum(material.s * np.diff(V) ** 2)),
    )


def metamaterial_force(material: Design | Specimen, v: Array, V: Array) -> Array:
    """Return the static force on every cell, -dU/dv_j of Eq. (1a), shape (N,)."""
    stretch = np.diff(v)
    force = -material.alpha * material.potential.slope(v - (V + material.offsets))
    force[:-1] += stretch
    force[1:] -= stretch
    return force


def substrate_force(material: Design | Specimen, v: Array, V: Array) -> Array:
    """Return the static force on every substrate site, -dU/dV_j of Eq. (1b), shape (N,)."""
    tension = material.s * np.diff(V)
    force = material.alpha * material.potential.slope(v - (V + material.offsets))
    force[:-1] += tension
    force[1:] -= tension
    return force


def actuator_force(chain: Chain) -> float:
    """Return the force that holds the substrate's end at V_N, tension positive.

    It is dU/dV_N: of the whole quasi-static foundation with the rigid substrate, of the end
    site with the elastic one.
    """
    force = -substrate_force(chain.specimen, chain.v, np.asarray(chain.V))
    if chain.design.substrate == 'elastic':
        return float(force[-1])
    return float(force @ chain.specimen.strain_shape)


def damping_power(chain: Chain) -> float:
    """Return the power that the on-site damping dissipates, eta times the squared speeds."""
    squares = np.sum(chain.velocity**2) + np.sum(chain.substrate_velocity**2)
    return chain.specimen.eta * float(squares)
