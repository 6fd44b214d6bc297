# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Formulas that give the same bits on every host: sine, cosine and exponential of arrays, and the
scalar formulas of the forces, which are written into the loops.

numpy's own choose between instruction sets at run time, whose results differ in the last bit.
These are made of additions, multiplications and roundings only, each of which IEEE 754 fixes.
Everything that enters the material's state is computed with them, so that a session replays
exactly.

Without a law of its own an element has the paper's: no branch, no table. The type of the constants
chooses the formula when a loop is compiled, so that every loop knows both laws, and none pays for
the other.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numba
import numpy as np

from .jit import compile_kernel, fma, inline_function
from .values import Array

# sin(r) / r as a polynomial in r^2 on [-pi/2, pi/2] (Chebyshev fit in 40 digits): error 1.2e-16;
# highest power first.
_SINE_COEFFICIENTS = (
    -7.374387503862757e-13,
    1.6048168318165643e-10,
    -2.505188194671259e-08,
    2.7557316609073673e-06,
    -1.9841269824861897e-04,
    8.333333333282756e-03,
    -0.16666666666666072,
    0.9999999999999999,
)
_EXP_COEFFICIENTS = tuple(1.0 / math.factorial(n) for n in range(13, -1, -1))
_LN2 = math.log(2.0)


def sine(x: Array) -> Array:
    """Return sin(x) within 1e-15 plus 2e-16 |x|, any shape."""
    return _map_elements(_sine_in_place, x)


def cosine(x: Array) -> Array:
    """Return cos(x) within 1e-15 plus 2e-16 |x|, any shape."""
    return sine(x + 0.5 * math.pi)


def exponential(x: Array) -> Array:
    """Return exp(x) for x up to 700, within 3e-16 (1 + |x|) relative, any shape.

    Results below the least number are 0, down to exp(-inf).
    """
    return _map_elements(_exponential_in_place, x)


def _map_elements(function: Callable[[Array], None], x: Array) -> Array:
    values = np.array(x, dtype=np.float64, order='C')
    function(values.reshape(-1))
    return values


@compile_kernel
def _sine_in_place(x: Array) -> None:
    """Replace numbers by their sines."""
    for i in range(len(x)):
        n = np.rint(x[i] * (1.0 / math.pi))
        r = x[i] - n * math.pi
        z, value = r * r, 0.0
        for coefficient in _SINE_COEFFICIENTS:
            value = value * z + coefficient
        half = 0.5 * n
        x[i] = r * value * (1.0 - 4.0 * (half - np.floor(half)))


@compile_kernel
def _exponential_in_place(x: Array) -> None:
    """Replace numbers by their exponentials."""
    for i in range(len(x)):
        at = -800.0 if x[i] < -800.0 else x[i]
        n = np.rint(at * (1.0 / _LN2))
        r, value = at - n * _LN2, 0.0
        for coefficient in _EXP_COEFFICIENTS:
            value = value * r + coefficient
        x[i] = math.ldexp(value, int(n))


INVERSE_TURN = 0.5 / math.pi


@inline_function
def sine_of_turns(turns: float) -> float:
    """Return sin(2 pi turns) by a vectorisable polynomial; no branch, no table.

    Whole turns are subtracted from the distance to the sine's crest, which is exact; the rest is
    folded into the quarter turn next to a zero. The error is below 1e-15 plus the rounding of the
    argument.
    """
    crest = turns - 0.25
    whole: float = np.rint(crest)
    h = abs(crest - whole) - 0.25
    z = h * h
    # -sin(2 pi h) / h on |h| <= 1/4 as a polynomial in h^2, by Horner's scheme (Remez fit in 50
    # digits: error 1.4e-16)
    odd = fma(z, 0.6921569856570443, -3.8172886541807443)
    odd = fma(z, odd, 15.09449947633629)
    odd = fma(z, odd, -42.05868966743087)
    odd = fma(z, odd, 76.70585968329284)
    odd = fma(z, odd, -81.60524927551286)
    odd = fma(z, odd, 41.34170224039802)
    odd = fma(z, odd, -6.283185307179585)
    return h * odd


class SplineConstants(NamedTuple):
    """What the loops take of a law that is a cubic spline (see `curve.Curve`).

    Attributes:
        height: alpha_j d, shape (N,).
        pieces: Coefficients of the force from power 0 up, shape (4, m + 1): of every interval, and
            before and after them of a straight line.
        per: Intervals in a unit of length.
    """

    height: Array
    pieces: Array
    per: float


@inline_function
def on_site_factors(constants: Any, j: int, y: float) -> tuple[float, float]:
    """Return two factors of alpha_j psi'(y + origin), the on-site force.

    Adding the product to something else rounds only once. The constants are those of
    `Potential.constants` or of `Curve.constants`.
    """
    slope, factor = _select_on_site(constants, j, y)
    return slope, factor


def _select_on_site(constants: Any, j: Any, y: Any) -> Any:
    """Where the compiler is off (NUMBA_DISABLE_JIT); compiled loops use the choice below."""
    return _overload_on_site(constants, j, y)(constants, j, y)


@numba.extending.overload(_select_on_site, inline='always')
def _overload_on_site(constants: Any, j: Any, y: Any) -> Any:
    def paper_force(constants: Any, j: Any, y: Any) -> Any:  # the force of page 3
        height, a, b = constants
        y2 = y * y
        turns = y * fma(INVERSE_TURN * b, y2, INVERSE_TURN * a)
        return height[j] * fma(3.0 * b, y2, a), sine_of_turns(turns)

    def spline_force(constants: Any, j: Any, y: Any) -> Any:  # y from before the first force
        height, pieces, per = constants
        place, last = y * per, float(pieces.shape[1] - 1)
        k = int(min(max(place, 0.0), last))  # 0 for NaN, which stays NaN
        t = place - k
        force = fma(t, fma(t, fma(t, pieces[3, k], pieces[2, k]), pieces[1, k]), pieces[0, k])
        return height[j], force

    # the compiler gives the type of the constants, a call without it the constants
    kind = getattr(constants, 'instance_class', type(constants))
    return spline_force if kind is SplineConstants else paper_force


@inline_function
def coupling_pull(constants: Any, j: int, left: float, x: float, right: float) -> float:
    """Return the pull of both neighbours' springs on a cell at x.

    Without constants they have stiffness 1, and nothing else is compiled. The first constant is
    the stiffness left of every cell and right of the last, 0 beyond the ends, shape (n + 1,). A
    second one is a constant force on every cell, shape (n,), which is added.
    """
    pull: float = _select_coupling(constants, j, left, x, right)
    return pull


def _select_coupling(constants: Any, j: Any, left: Any, x: Any, right: Any) -> Any:
    """Where the compiler is off (NUMBA_DISABLE_JIT); compiled loops use the choice below."""
    return _overload_coupling(constants, j, left, x, right)(constants, j, left, x, right)


@numba.extending.overload(_select_coupling, inline='always')
def _overload_coupling(constants: Any, j: Any, left: Any, x: Any, right: Any) -> Any:
    def uniform_pull(constants: Any, j: Any, left: Any, x: Any, right: Any) -> Any:
        return fma(-2.0, x, left) + right

    def scattered_pull(constants: Any, j: Any, left: Any, x: Any, right: Any) -> Any:
        k_r = constants[0]
        return fma(k_r[j + 1], right - x, -k_r[j] * (x - left))

    def forced_pull(constants: Any, j: Any, left: Any, x: Any, right: Any) -> Any:
        k_r, force = constants
        return fma(k_r[j + 1], right - x, fma(-k_r[j], x - left, force[j]))

    return (uniform_pull, scattered_pull, forced_pull)[len(constants)]


@inline_function
def join_motion(mobility: float, cell: float, below: float) -> float:
    """Return the motion of a cell that sticks to its substrate cell, of mass 1: the mean of what
    both would do alone, weighted by their masses. What one does to the other cancels.
    """
    return (cell + mobility * below) / (1.0 + mobility)


@inline_function
def dry_friction(constants: tuple[float, float], v: float) -> float:
    """Return the dry friction at a velocity: its limit, and the velocity where it is viscous."""
    force, creep = constants
    return force * v / math.sqrt(v * v + creep * creep)
