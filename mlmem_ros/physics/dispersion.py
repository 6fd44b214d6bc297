# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Small harmonic waves on a uniform chain: Eq. (4), omega^2 = k_s + 2 - 2 cos(kappa)."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray


def frequency(kappa: ArrayLike, k_s: float) -> NDArray[np.float64]:
    """Return the angular frequency of a propagating wave.

    Args:
        kappa: Wavenumber in rad per lattice constant, any shape.
        k_s: On-site stiffness of the phase, in k_r.
    """
    return np.sqrt(k_s + 2.0 - 2.0 * np.cos(np.asarray(kappa, dtype=np.float64)))


def wavenumber(omega: ArrayLike, k_s: float) -> NDArray[np.complex128]:
    """Return the complex wavenumber kappa_R + i kappa_I of a frequency (Fig. 3a).

    Inside the band it is real, outside its imaginary part is the decay per cell.

    Args:
        omega: Angular frequency, any shape.
        k_s: On-site stiffness of the phase, in k_r.
    """
    cosine = (k_s + 2.0 - np.asarray(omega, dtype=np.float64) ** 2) / 2.0
    kappa: NDArray[np.complex128] = np.arccos(cosine.astype(np.complex128))
    return np.asarray(np.abs(kappa.real) + 1j * np.abs(kappa.imag))


def band(k_s: float) -> tuple[float, float]:
    """Return the lowest and the highest propagating angular frequency of a phase."""
    return math.sqrt(k_s), math.sqrt(k_s + 4.0)


def group_velocity(omega: ArrayLike, k_s: float) -> NDArray[np.float64]:
    """Return d omega / d kappa = sin(kappa) / omega in cells per time unit; 0 outside the band.

    Args:
        omega: Angular frequency, positive, any shape.
        k_s: On-site stiffness of the phase, in k_r.
    """
    omega = np.asarray(omega, dtype=np.float64)
    cosine = np.clip((k_s + 2.0 - omega**2) / 2.0, -1.0, 1.0)
    return np.asarray(np.sqrt(1.0 - cosine**2) / omega)


def fastest_speed(k_s: float) -> float:
    """Return the greatest group velocity of a phase, (sqrt(k_s + 4) - sqrt(k_s)) / 2."""
    return 0.5 * (math.sqrt(k_s + 4.0) - math.sqrt(k_s))
