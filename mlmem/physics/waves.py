# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Small harmonic waves: on a uniform chain, and about any element at rest.

In a phase they follow Eq. (4), omega^2 = k_s + 2 - 2 cos(kappa).

About an equilibrium the chain is linear. With u the displacement of a cell and T the tension of
the spring on its right, motion as exp(i omega t) makes

    T_j = T_{j-1} + E_j u_j,  u_{j+1} = u_j + T_j / k_j,  E_j = alpha_j psi'' - m_j omega^2 +
    i eta omega,

a 2 x 2 matrix of determinant 1 for each cell, and their product for any part of the chain. Both
ends are free: T_0 = -f, where f is the force on the first cell, and T_N = 0. So the lower row
(p, q) of the whole product says what the ends do:

    f = (p / q) u_1,  u_N = f / p.

What a row is right of a part gives what it is left of it: a continued fraction, from the far end.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .jit import compile_kernel
from .pefrl import squared_frequency
from .specimen import Material, Specimen, as_specimen
from .values import Array
from .values import Complex as Complex


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


def pass_band(k_s: float) -> tuple[float, float]:
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


class Tones(NamedTuple):
    """Frequencies, and what they make of a cell.

    Attributes:
        omega: Complex frequencies, shape (F,): an imaginary part below 0 is a decay, as of what is
            weighted with exp(omega_i t).
        square: What a mass adds to the stiffness of its cell, -omega^2; with a time step, as a
            chain has it.
        loss: What its damping adds, i eta omega.
    """

    omega: Complex
    square: Complex
    loss: Complex

    @classmethod
    def from_steps(cls, made: Specimen, omega: Complex, dt: float) -> Tones:
        """Return frequencies as a chain of steps dt has them; see `squared_frequency`."""
        exact = omega * omega - 1j * made.eta * omega
        K = squared_frequency(omega, made.eta, dt)
        return cls(omega, -omega * omega - (K - exact), 1j * made.eta * omega)


def linearize_cells(material: Material, v: Array) -> tuple[Array, Array, Array]:
    """Return stiffness, mass and the stiffness of the spring on the right, of every cell of an
    element at rest in displacements v: shape (N,) each, as `multiply_matrices` takes them.
    """
    made = as_specimen(material)
    stiffness = np.asarray(made.alpha * made.potential.stiffness(v - made.offsets))
    # stiff enough to stand for a stuck cell
    stiffness[made.stuck_indices] = 1e9
    return stiffness, made.masses, np.append(made.k_r, 1.0)


def carry_rows(
    lower: Complex, stiffness: Array, mass: Array, spring: Array, square: Complex, loss: Complex
) -> Complex:
    """Return what lower rows right of cells in a row are left of them, shape (m, 2, F).

    Args:
        lower: Rows (p, q), one of each element, shape (m, 2, F).
        stiffness: Of the cells of each element, from the left, shape (m, n).
        mass: Of the cells, shape (n,).
        spring: On the right of each, shape (n,).
        square: See `Tones`; shape (F,).
        loss: See `Tones`; shape (F,).
    """
    parts = square.real, square.imag, loss.real, loss.imag
    sr, si, lr, li = (np.ascontiguousarray(each) for each in parts)
    lower, stiffness = np.ascontiguousarray(lower), np.ascontiguousarray(stiffness)
    return _carry_rows(lower, stiffness, mass, spring, sr, si, lr, li)


@compile_kernel
def _carry_rows(
    lower: Complex, stiffness: Array, mass: Array, spring: Array,
    sr: Array, si: Array, lr: Array, li: Array,
) -> Complex:  # fmt: skip
    found = np.empty_like(lower)
    for i in range(len(lower)):
        pr, pi = lower[i, 0].real.copy(), lower[i, 0].imag.copy()
        qr, qi = lower[i, 1].real.copy(), lower[i, 1].imag.copy()
        for j in range(len(mass) - 1, -1, -1):
            share, own, m = 1.0 / spring[j], stiffness[i, j], mass[j]
            for k in range(len(pr)):
                a, b = qr[k] + share * pr[k], qi[k] + share * pi[k]
                real, imag = own + m * sr[k] + lr[k], m * si[k] + li[k]
                pr[k] += real * a - imag * b
                pi[k] += real * b + imag * a
                qr[k], qi[k] = a, b
        found[i, 0], found[i, 1] = pr + 1j * pi, qr + 1j * qi
    return found


def multiply_matrices(
    stiffness: Array, mass: Array, spring: Array, square: Complex, loss: Complex
) -> Complex:
    """Return the matrix of cells in a row, from the left, shape (F, 2, 2)."""
    one = np.zeros((2, 2, len(square)), dtype=np.complex128)
    one[0, 0] = one[1, 1] = 1.0
    both = carry_rows(one, np.stack((stiffness, stiffness)), mass, spring, square, loss)
    return np.ascontiguousarray(np.moveaxis(both, 2, 0))


@compile_kernel
def combine_rows(parts: Complex, chosen: NDArray[np.int64]) -> Complex:
    """Return the lower rows (p, q) of elements put together of parts, shape (m, 2, F).

    Args:
        parts: Matrices of all parts, shape (number, F, 2, 2).
        chosen: Which each element consists of, from the left, shape (m, parts of an element).
    """
    found = np.empty((len(chosen), 2, parts.shape[1]), dtype=np.complex128)
    for i in range(len(chosen)):
        for k in range(parts.shape[1]):
            p, q = 0.0 + 0.0j, 1.0 + 0.0j
            for n in range(chosen.shape[1] - 1, -1, -1):
                part = parts[chosen[i, n], k]
                p, q = p * part[0, 0] + q * part[1, 0], p * part[0, 1] + q * part[1, 1]
            found[i, 0, k], found[i, 1, k] = p, q
    return found
