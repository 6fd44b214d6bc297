# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Small harmonic waves on a resting element: the reflection at an end, frequency by frequency.

The equation of motion (1a), linearised about the resting configuration, is a three-term
recursion in j. Its solution from the far end includes all effects of wall, defects, gradient and
damping on a wave, with no approximation but linearity.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..device.end import End
from ..physics.methods import NOH_BATHE, Integrator
from ..physics.potential import Array
from ..physics.specimen import Specimen

Spectrum = NDArray[np.complex128]


def echo_response(
    specimen: Specimen,
    v: Array,
    omega: Array,
    end: End,
    dt: float = 0.0,
    integrator: Integrator = NOH_BATHE,
) -> Spectrum:
    """Return the first echo at a free end relative to the end's driven motion.

    Args:
        specimen: The element, unstrained.
        v: Its displacements at rest, shape (N,).
        omega: Angular frequencies, shape (m,), positive; the time factor is exp(i omega t).
        end: The end that is driven, released and listened to.
        dt: Step of the integrator whose numerical damping and dispersion to include; 0 for none.
        integrator: That integrator.

    Returns:
        Ratio of the complex amplitudes, shape (m,).
    """
    stiffness = specimen.alpha * specimen.potential.stiffness(v - specimen.offsets)
    if end is End.RIGHT:
        stiffness = stiffness[::-1]
    common = 2.0 - integrator.squared_frequency(omega, specimen.eta, dt)
    ratio = 1.0 / (stiffness[-1] + common - 1.0)  # v_N / v_{N-1}: the far end is free
    for local in stiffness[-2:0:-1]:
        ratio = 1.0 / (local + common - ratio)
    outgoing = propagation(stiffness[0] + common)
    reflected = (ratio - outgoing) / (1.0 / outgoing - ratio)
    return np.asarray(reflected * (1.0 + outgoing))  # a free end moves farther than the wave


def propagation(trace: Spectrum) -> Spectrum:
    """Return the decaying theta of Eq. (4), theta + 1 / theta = trace, |theta| < 1."""
    root = np.sqrt(trace**2 - 4.0)
    first = 0.5 * (trace - root)
    return np.where(np.abs(first) < 1.0, first, 0.5 * (trace + root))
