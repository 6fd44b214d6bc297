# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The scalar formulas of the forces, which are written into the loops.

Without a law of its own an element has the paper's: no branch, no table. The type of a law's
constants chooses its formula when a loop is compiled (`jit.formula`), so every loop knows every
law, and none pays for the others.
"""

from __future__ import annotations

import math
from typing import Any

import numba
import numpy as np

from .jit import fma, formula_for, inlined

INVERSE_TURN = 0.5 / math.pi

# -sin(2 pi h) / h on |h| <= 1/4 as a polynomial in h^2, lowest power first (Remez fit in 50
# digits: error 1.4e-16).
S0 = -6.283185307179585
S1 = 41.34170224039802
S2 = -81.60524927551286
S3 = 76.70585968329284
S4 = -42.05868966743087
S5 = 15.09449947633629
S6 = -3.8172886541807443
S7 = 0.6921569856570443


@inlined
def wave(turns: float) -> float:
    """Return sin(2 pi turns) by a vectorisable polynomial; no branch, no table.

    Whole turns are subtracted from the distance to the sine's crest, which is exact; the rest is
    folded into the quarter turn next to a zero. The error is below 1e-15 plus the rounding of the
    argument.
    """
    crest = turns - 0.25
    whole: float = np.rint(crest)
    h = abs(crest - whole) - 0.25
    z = h * h
    odd = fma(z, fma(z, fma(z, fma(z, fma(z, fma(z, fma(z, S7, S6), S5), S4), S3), S2), S1), S0)
    return h * odd


@inlined
def on_site(constants: Any, j: int, y: float) -> tuple[float, float]:
    """Return two factors of alpha_j psi'(y + origin), the on-site force.

    Adding the product to something else rounds only once. The constants are those of
    `Potential.constants`, or of another law.
    """
    slope, factor = _slope(constants, j, y)
    return slope, factor


def _slope(constants: Any, j: Any, y: Any) -> Any:
    raise NotImplementedError  # only the compiler's choice below is called


@numba.extending.overload(_slope, inline='always')
def _slope_by_type(constants: Any, j: Any, y: Any) -> Any:
    def paper(constants: Any, j: Any, y: Any) -> Any:  # the force of page 3
        height, a, b = constants
        y2 = y * y
        turns = y * fma(INVERSE_TURN * b, y2, INVERSE_TURN * a)
        return height[j] * fma(3.0 * b, y2, a), wave(turns)

    law = formula_for(constants)
    return paper if law is None else law.py_func


@inlined
def coupling(constants: Any, j: int, left: float, x: float, right: float) -> float:
    """Return the pull of both neighbours' springs on a cell at x.

    Without constants they have stiffness 1, and nothing else is compiled. The one constant is the
    stiffness left of every cell and right of the last, 0 beyond the ends, shape (n + 1,). A
    coupling with a formula of its own has other constants.
    """
    pull: float = _pull(constants, j, left, x, right)
    return pull


def _pull(constants: Any, j: Any, left: Any, x: Any, right: Any) -> Any:
    raise NotImplementedError  # only the compiler's choice below is called


@numba.extending.overload(_pull, inline='always')
def _pull_by_type(constants: Any, j: Any, left: Any, x: Any, right: Any) -> Any:
    def alike(constants: Any, j: Any, left: Any, x: Any, right: Any) -> Any:
        return fma(-2.0, x, left) + right

    def scattered(constants: Any, j: Any, left: Any, x: Any, right: Any) -> Any:
        k_r = constants[0]
        return fma(k_r[j + 1], right - x, -k_r[j] * (x - left))

    law = formula_for(constants)
    if law is not None:
        return law.py_func
    return scattered if len(constants) else alike


@inlined
def joined(mobility: float, cell: float, below: float) -> float:
    """Return the motion of a cell that sticks to its substrate cell, of mass 1: the mean of what
    both would do alone, weighted by their masses. What one does to the other cancels.
    """
    return (cell + mobility * below) / (1.0 + mobility)


@inlined
def rub(constants: tuple[float, float], v: float) -> float:
    """Return the dry friction at a velocity: its limit, and the velocity where it is viscous."""
    force, creep = constants
    return force * v / math.sqrt(v * v + creep * creep)
