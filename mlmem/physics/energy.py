# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The energy of a chain, and the force that its actuator holds.

Both come from the Lagrangian alone, not from the accelerations of the loops.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .chain import Chain
from .equilibrium import compute_energies, metamaterial_force, substrate_force
from .specimen import Material, as_specimen
from .values import Array


@dataclass(frozen=True)
class Energy:
    """The parts of a chain's energy, in k_r (lattice constant)^2.

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
    """Return the energy of a chain's current state."""
    motion = kinetic_energy(chain, chain.velocity, chain.substrate_velocity)
    return Energy(float(motion), *map(float, compute_energies(chain, chain.v, chain.V)))


def kinetic_energy(material: Material, velocity: Array, substrate_velocity: Array) -> Array:
    """Return the kinetic energy of both chains; velocities of shape (..., N)."""
    cells = np.sum(as_specimen(material).masses * velocity**2, axis=-1)
    return np.asarray(0.5 * (cells + np.sum(substrate_velocity**2, axis=-1)))


def end_force(material: Material, v: Array, V: Array) -> Array:
    """Return the force that holds the substrate's end, dU/dV_N, tension positive.

    Displacements have shape (..., N), the force is in k_r lattice constants.

    With the rigid substrate it is the force on the whole quasi-static foundation, with the elastic
    one that on the end site.
    """
    made = as_specimen(material)
    force = -substrate_force(made, v, V)
    if made.stuck:  # the substrate carries these cells, and what pulls at them
        carried = made.stuck_indices
        force[..., carried] -= metamaterial_force(made, v, V)[..., carried]
    rigid = made.design.substrate == 'rigid'
    return np.asarray(force @ made.strain_shape if rigid else force[..., -1])
