# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Rest: a chain in which nothing moves but the last bits of its numbers."""

from __future__ import annotations

from ..formulas import coupling, on_site
from ..jit import fma, inlined, kernel
from ..potential import Array
from .integrator import Cells

REST = 1e-13
"""Speed and acceleration below which a cell rests.

Rounding makes a chain tremble at 1e-15 for ever. To stop a wave of this size changes an echo's v_c
by less than 2e-14, a fifth of the least threshold, and no delay; nor did one of 1e-6. An elastic
substrate under strain is so stiff that it trembles more, and never rests.
"""


@inlined
def slow(v: Array, limit: float) -> bool:
    """Return whether all cells are slower than a limit; at a limit of 0 none is."""
    for each in v:  # noqa: SIM110 (compiled code has no generators)
        if not abs(each) < limit:
            return False
    return True


@kernel
def balanced(u: Array, U: Array | None, cells: Cells, V_N: float) -> bool:
    """Return whether the forces of a chain without motion leave it at rest.

    Args:
        u: Displacements with their ghost cells, which are renewed.
        U: The same of an elastic substrate, or None.
        cells: The element.
        V_N: Displacement of the substrate's end.

    Returns:
        Whether no cell has an acceleration of `REST` or more.
    """
    law, spring, origin, mobility, under, stuck, _ = cells
    n = len(u) - 2
    if U is not None and len(stuck) > 0:
        return False  # nor does a strained elastic substrate ever rest
    u[0] = u[1]
    u[n + 1] = u[n]
    for j in range(n):
        x = u[j + 1]
        y = x - (fma(V_N, under[j], origin[j]) if U is None else U[j + 1] + origin[j])
        slope, sine = on_site(law, j, y)
        pull = fma(-slope, sine, coupling(spring, j, u[j], x, u[j + 2]))
        if not abs(mobility[j] * pull) < REST:
            return False
        if U is not None and 0 < j < n - 1:
            tension = under[j + 1] * (U[j + 2] - U[j + 1])
            pull = fma(-under[j], U[j + 1] - U[j], tension)
            if not abs(fma(slope, sine, pull)) < REST:
                return False
    return True
