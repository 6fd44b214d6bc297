# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The on-site energy of a bistable shell between rails, as its authors measured and fitted it.

The rails pre-compress a shell, and the more they do, the farther off is its second well. A shell
whose well is not at one of the three measured places is a blend of the two measured energies
beside it, each stretched to the well: a family with one parameter, the prestrain.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from ..lattices import Pieces

DEGREE = 4


@dataclass(frozen=True, eq=False)
class Shell:
    """A bistable shell.

    Attributes:
        energy: On-site energy of the displacement in cm; 0.1 J.
        well: Its second well, cm.
    """

    energy: Pieces
    well: float

    def gain(self) -> float:
        """Return the energy that a passage from the first to the second well sets free, 0.1 J."""
        middles = (np.arange(20_000) + 0.5) / 20_000 * self.well
        return float(-self.well * self.energy.derivative(middles, 1).mean())


def _measured(edges: tuple[float, float], well: float, *pieces: tuple[float, ...]) -> Shell:
    filled = [np.pad(piece, (0, DEGREE + 1 - len(piece))) for piece in pieces]
    return Shell(Pieces(np.array(filled), np.array(edges)), well)


MEASURED = {
    21.5: _measured(
        (1.75, 5.229), 6.264,
        (0.0, 0.0, 0.0256743, -0.00489034),
        (0.10991, -0.204049, 0.160139, -0.040711, 0.00291668),
        (-0.809805, 4.92206, -0.979682, 0.0624519),
    ),
    22.0: _measured(
        (1.091, 3.81635), 5.270,
        (0.0, 0.0, 0.0593034, -0.018119),
        (0.0216472, -0.0664308, 0.132853, -0.0521944, 0.00531799),
        (-0.815088, 0.886911, -0.271859, 0.0237451),
    ),
    22.5: _measured(
        (1.104, 2.61696), 3.971,
        (0.0, 0.0, 0.0402355, -0.0121484),
        (0.139316, -0.416266, 0.48557, -0.208458, 0.0280114),
        (-0.142865, 0.409241, -0.213546, 0.0272003),
    ),
}  # fmt: skip
"""The authors' energies, by the distance of the rails in cm. (Their additive constants do not
join: the third piece at 21.5 lies 7.3 too high. Only slopes matter, and those do.)"""


@cache
def shell(well: float) -> Shell:
    """Return the shell whose second well is at a place, in cm.

    It has five pieces, however few differ. Beyond the outermost measured wells the blend is
    extrapolated.
    """
    known = sorted(MEASURED.values(), key=lambda each: each.well)
    low, high = known[:2] if well < known[1].well else known[1:]
    share = (well - low.well) / (high.well - low.well)
    scaled = [
        (1.0 - share, well / low.well, low.energy),
        (share, well / high.well, high.energy),
    ]
    edges = np.sort(np.concatenate([each.edges * stretch for _, stretch, each in scaled]))
    middles = np.concatenate(([edges[0] - 1.0], 0.5 * (edges[1:] + edges[:-1]), [edges[-1] + 1.0]))
    coefficients = np.zeros((len(middles), DEGREE + 1))
    for weight, stretch, each in scaled:
        piece = each.coefficients[np.searchsorted(each.edges, middles / stretch)]
        coefficients += weight * piece / stretch ** np.arange(DEGREE + 1)
    return Shell(Pieces(coefficients, edges), well)
