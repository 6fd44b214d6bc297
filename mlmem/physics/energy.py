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
from .potential import Array
from .specimen import Specimen


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
    motion = kinetic_energy(chain.specimen, chain.velocity, chain.substrate_velocity)
    return Energy(float(motion), *map(float, compute_energies(chain.specimen, chain.v, chain.V)))


def kinetic_energy(made: Specimen, velocity: Array, substrate_velocity: Array) -> Array:
    """Return the kinetic energy of both chains; velocities of shape (..., N)."""
    motion = np.sum(made.masses * velocity**2, axis=-1) + np.sum(substrate_velocity**2, axis=-1)
    return np.asarray(0.5 * motion)


def actuator_force(chain: Chain) -> float:
    """Return the force that holds the substrate's end at V_N, tension positive."""
    return float(end_force(chain.specimen, chain.v, chain.V))


def end_force(made: Specimen, v: Array, V: Array) -> Array:
    """Return dU/dV_N, for displacements of shape (..., N).

    With the rigid substrate it is the force on the whole quasi-static foundation, with the elastic
    one that on the end site.
    """
    force = -substrate_force(made, v, V)
    if made.stuck:  # the substrate carries these cells, and what pulls at them
        carried = np.array(made.stuck) - 1
        force[..., carried] -= metamaterial_force(made, v, V)[..., carried]
    rigid = made.design.substrate == 'rigid'
    return np.asarray(force @ made.strain_shape if rigid else force[..., -1])
