# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The energy landscape of a wall, by the paper's method: two ansatzes and an integral, Eq. (3).

The paper leaves three things open. We settle them so that the pieces fit:

- V_0 is fitted but does not occur in Eq. (3). We use psi of the whole configuration, v(x; X) +
  v_0(x) - V_0(x); `compute_landscape(..., as_printed=True)` uses psi(v) as printed.
- The kink ansatz goes to 0 ahead of the wall. So v is counted from the inactive phase, and v_0
  is the equilibrium of the element that is inactive throughout, which contains D_s1.
- The Fourier terms need a wavelength. A free end bends v_0 within a few cells, which is not
  periodic over the element, so we take twice its length.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from mlmem.errors import StateError
from mlmem.physics.design import Design
from mlmem.physics.equilibrium import relax_to_equilibrium
from mlmem.physics.held_wall import hold_walls, make_uniform
from mlmem.physics.values import Array

MAX_FIT_ERROR = 1.35e-4
"""The paper's bound of the root-mean-square error of every fit (page 3)."""


@dataclass(frozen=True)
class KinkFit:
    """The wall's profile v(x; X) = A arctan[B_1 exp(C_1 (x - X)) + B_2 exp(C_2 (x - X))].

    Attributes:
        A: Step of the displacement across the wall, divided by pi / 2.
        B_1: Constant.
        C_1: Constant, negative for an anti-kink.
        B_2: Constant.
        C_2: Constant, negative for an anti-kink.
        e_rms: Root-mean-square error over the element that was fitted.
    """

    A: float
    B_1: float
    C_1: float
    B_2: float
    C_2: float
    e_rms: float = math.nan

    def displacement(self, x: Array) -> Array:
        """Return v at distances x - X from the wall, counted from the inactive phase."""
        return np.asarray(self.A * np.arctan(sum(self._evaluate_exponentials(x))))

    def slope(self, x: Array) -> Array:
        """Return dv/dx at distances x - X from the wall."""
        first, second = self._evaluate_exponentials(x)
        slope = self.C_1 * first + self.C_2 * second
        return np.asarray(self.A * slope / (1.0 + (first + second) ** 2))

    def _evaluate_exponentials(self, x: Array) -> tuple[Array, Array]:
        first, second = np.exp(np.clip(np.outer((self.C_1, self.C_2), x), -300.0, 300.0))
        return self.B_1 * first, self.B_2 * second


@dataclass(frozen=True)
class DisplacementFit:
    """A strain-induced displacement: a linear function and a Fourier expansion (page 3).

    Attributes:
        a_0: Constant of the linear function a_0 + c_0 x.
        c_0: Its slope.
        a: Fourier coefficients a_1 ... a_q of the cosines.
        b: Fourier coefficients b_1 ... b_q of the sines.
        length: Wavelength of the first term, in cells.
        e_rms: Root-mean-square error over the sites.
    """

    a_0: float
    c_0: float
    a: Array
    b: Array
    length: float
    e_rms: float

    def displacement(self, x: Array) -> Array:
        """Return the displacement at positions x in sites."""
        cosines, sines = _fourier_terms(x, self.length, len(self.a))
        return self.a_0 + self.c_0 * x + self.a @ cosines + self.b @ sines

    def slope(self, x: Array) -> Array:
        """Return its derivative at positions x."""
        cosines, sines = _fourier_terms(x, self.length, len(self.a))
        k = 2.0 * math.pi / self.length * np.arange(1, len(self.a) + 1)
        return self.c_0 + (self.b * k) @ cosines - (self.a * k) @ sines


def _fourier_terms(x: Array, length: float, q: int) -> tuple[Array, Array]:
    """Return the first q cosines and sines at positions x, shape (q, m) each."""
    angle = 2.0 * math.pi / length * np.outer(np.arange(1, q + 1), x)
    return np.cos(angle), np.sin(angle)


def fit_kink(design: Design) -> KinkFit:
    """Fit the arctan ansatz to the anti-kink at rest in the uniform, unstrained element.

    Gamma and beta of the design are set to zero.

    Returns:
        The least-squares fit over all sites, X being where the configuration crosses the
        barrier.

    Raises:
        StateError: The wall does not settle, or the fit does not converge.
    """
    from scipy.optimize import least_squares  # not needed to run a device

    flat = make_uniform(design)
    # It rests where the Peierls-Nabarro potential of period 1 is least. In Case I that is flat
    # to rounding, so Newton's method alone could not tell a minimum from a maximum.
    held = hold_walls(flat, flat.N // 2 + np.arange(0.0, 1.0, 1 / 16), np.zeros(flat.N))
    least = int(held.energy.argmin())
    v, x = held.v[least], flat.sites - held.positions[least]
    # Far from the wall one exponential remains: the slow one of s1 ahead, the fast one of s2
    # behind. The two agree with the decay of small static displacements, cosh(C) = 1 + k / 2.
    start = np.array([
        2.0 / math.pi * (flat.D_s2 - flat.D_s1),
        0.5, -math.acosh(1.0 + flat.k_s1 / 2.0), 0.5, -math.acosh(1.0 + flat.k_s2 / 2.0),
    ])  # fmt: skip

    def kink_residual(constants: Array) -> Array:
        return np.asarray(KinkFit(*constants).displacement(x) - (v - flat.D_s1))

    fit = least_squares(kink_residual, start, method='lm', xtol=1e-12, ftol=1e-15)
    if not fit.success:
        raise StateError(reason=f'the kink ansatz must converge; it did not: {fit.message}')
    return replace(KinkFit(*fit.x.tolist()), e_rms=_root_mean_square(fit.fun))


def fit_displacement(design: Design, displacement: Array, max_order: int = 40) -> DisplacementFit:
    """Fit the linear-plus-Fourier ansatz of least order that meets the paper's bound.

    It is v_0 or V_0 at the sites, shape (N,).

    Raises:
        StateError: No order up to the greatest one meets the bound.
    """
    x, length = design.sites, 2.0 * design.N
    for q in range(1, max_order + 1):
        cosines, sines = _fourier_terms(x, length, q)
        terms = np.column_stack((np.ones_like(x), x, cosines.T, sines.T))
        solution = np.asarray(np.linalg.lstsq(terms, displacement, rcond=1e-13)[0], np.float64)
        e_rms = _root_mean_square(terms @ solution - displacement)
        if e_rms < MAX_FIT_ERROR:
            a, b = solution[2 : 2 + q], solution[2 + q :]
            return DisplacementFit(float(solution[0]), float(solution[1]), a, b, length, e_rms)
    expected = f'at most {MAX_FIT_ERROR:.3g} with an order of at most {max_order}'
    raise StateError.out_of_range('e_rms', e_rms, expected)


def strained_equilibrium(design: Design, strain: float) -> tuple[Array, Array]:
    """Return v_0 and V_0: the equilibrium of the inactive element under a strain, (N,) each."""
    V = design.end_displacement(strain) * design.strain_shape
    return relax_to_equilibrium(design, V + design.D_s1, V), V


def compute_landscape(
    design: Design,
    positions: Array,
    kink: KinkFit,
    v_0: DisplacementFit,
    V_0: DisplacementFit,
    *,
    as_printed: bool = False,
) -> Array:
    """Return the total potential energy U(X) of a wall at the positions X, Eq. (3).

    Args:
        positions: X in sites, shape (m,).
        kink: The wall's profile.
        v_0: Equilibrium displacement of the metamaterial, which holds D_s1.
        V_0: Equilibrium displacement of the substrate.
        as_printed: Take psi(v) as Eq. (3) has it, not psi(v + v_0 - V_0).

    Returns:
        U in k_r (lattice constant)^2, shape (m,).
    """
    points_per_cell = 8  # of the integral's midpoint rule; alpha is constant within a cell
    step = 1.0 / points_per_cell
    x = np.arange(0.5 + 0.5 * step, design.N + 0.5, step)
    alpha = np.repeat(design.alpha, points_per_cell)
    rest = v_0.displacement(x) - V_0.displacement(x)
    if as_printed:
        rest = np.full_like(x, design.D_s1)
    strain = v_0.slope(x)
    energy = np.empty(len(positions))
    for i, X in enumerate(positions):
        configuration = kink.displacement(x - X) + rest
        stretch = kink.slope(x - X) + strain
        density = alpha * design.potential.energy(configuration) + 0.5 * stretch**2
        energy[i] = step * density.sum()
    return energy


def _root_mean_square(residual: Array) -> float:
    return float(np.sqrt(np.mean(residual**2)))
