# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Energies and forces of displacements at rest, defined once.

Displacements v of the metamaterial and V of the substrate have shape (..., N): one state, or any
number of them at once. Energies are in k_r (lattice constant)^2.
"""

from __future__ import annotations

import numpy as np

from .potential import Array
from .specimen import Specimen


def energies(specimen: Specimen, v: Array, V: Array) -> tuple[Array, Array, Array]:
    """Return the energies of coupling, on-site and substrate springs, shape (...) each."""
    on_site = specimen.alpha * specimen.potential.energy(v - (V + specimen.offsets))
    return (
        np.asarray(0.5 * np.sum(specimen.k_r * np.diff(v) ** 2, axis=-1)),
        np.asarray(np.sum(on_site, axis=-1)),
        np.asarray(0.5 * np.sum(specimen.s * np.diff(V) ** 2, axis=-1)),
    )


def metamaterial_force(specimen: Specimen, v: Array, V: Array) -> Array:
    """Return the force on every cell, -dU/dv_j of Eq. (1a), shape (..., N)."""
    return _with_springs(-_on_site(specimen, v, V), specimen.k_r * np.diff(v))


def substrate_force(specimen: Specimen, v: Array, V: Array) -> Array:
    """Return the force on every substrate site, -dU/dV_j of Eq. (1b), shape (..., N)."""
    return _with_springs(_on_site(specimen, v, V), specimen.s * np.diff(V))


def stiffness(specimen: Specimen, v: Array, V: Array) -> Array:
    """Return d2U/dv_j2, shape (..., N): the diagonal of a matrix with -k_r beside it."""
    on_site = specimen.alpha * specimen.potential.stiffness(v - (V + specimen.offsets))
    diagonal = on_site + specimen.tied
    diagonal[..., [0, -1]] -= specimen.k_r[[0, -1]]
    return np.asarray(diagonal)


def _on_site(specimen: Specimen, v: Array, V: Array) -> Array:
    """Return the pull of the on-site springs on the substrate, shape (..., N)."""
    slope = specimen.potential.slope(v - (V + specimen.offsets))
    return np.asarray(specimen.alpha * slope)


def _with_springs(force: Array, tension: Array) -> Array:
    """Add the pull of springs in series, tensions of shape (..., N - 1)."""
    force[..., :-1] += tension
    force[..., 1:] -= tension
    return force
