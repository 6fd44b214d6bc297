# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The unknowns of an element and its instrument.

They form one vector. First the amplifications alpha_j in units of the design's d: only alpha_j d
acts, so d keeps its value. Then what all cells share; then, if asked for, masses and offsets of
the cells, and the stiffness of the springs between them.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from mlmem.instrument.end import End
from mlmem.physics import Design, Specimen
from mlmem.physics.curve import Curve
from mlmem.physics.values import Array

SHARED_UNKNOWNS = (
    'D_s1', 'D_s2', 'c', 'eta', 'time_unit', 'substrate_ratio', 'j_0',
    'zero_left', 'zero_right', 'gain_left', 'gain_right', 'drive_left', 'drive_right',
    'late_left', 'late_right', 'lag_left', 'lag_right',
)  # fmt: skip
"""What all cells share: ground states, offset of the potential (the skew of a law of its own),
damping, the time unit of the instrument in true ones, s_max / s_min, j_0; and the transducers:
zero, gain as a sensor, gain as a driver, and by how much time units of the instrument each is late
as a sensor and as a driver."""

CELL_TERMS = {'masses': 'mass', 'offsets': 'offset', 'springs': 'k_r', 'damping': 'damping'}
"""Terms of a model that have a value for every cell, or spring between two, in the order of the
vector; and the name of its values in reports."""


def lay_out_cells(terms: Collection[str], cells: int, start: int) -> dict[str, slice]:
    """Return where the values of each of `CELL_TERMS` are in a vector, from a start on; those of a
    term that is not sought are nowhere.
    """
    found = {}
    for term in CELL_TERMS:
        stop = start + (cells - (term == 'springs')) * (term in terms)
        found[term] = slice(start, stop)
        start = stop
    return found


@dataclass(frozen=True, eq=False)
class Unknowns:
    """The vector of unknowns of a design.

    Attributes:
        terms: What is sought beside alpha and the shared values: of `CELL_TERMS`; 'latency', by
            which a transducer is late; 'friction', the derivative by which is taken, though the
            model has none.
    """

    design: Design
    terms: frozenset[str] = frozenset()

    @cached_property
    def cells(self) -> dict[str, slice]:
        """Where the values of the cells are, by `CELL_TERMS`."""
        return lay_out_cells(self.terms, self.design.N, self.shared_end)

    def cell_values(self, x: Array, term: str, known: Array | float) -> Array | float:
        """Return the values of the cells in a vector, or what is known if they are not sought."""
        return x[self.cells[term]] if term in self.terms else known

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return int(self.cells['damping'].stop) + ('friction' in self.terms)

    @property
    def alpha(self) -> slice:
        """Where the amplifications are."""
        return slice(0, self.design.N)

    def shared(self, name: str) -> int:
        """Return where a shared unknown is."""
        return self.design.N + SHARED_UNKNOWNS.index(name)

    @property
    def shared_end(self) -> int:
        """Where the shared unknowns end."""
        return self.design.N + len(SHARED_UNKNOWNS)

    @property
    def mean(self) -> Array:
        """The design's values, shape (size,)."""
        design = self.design
        shared = (
            design.D_s1, design.D_s2, 0.0 if design.law else design.c, design.eta, 1.0,
            design.s_max / design.s_min, design.j_0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0,
            0.0, 0.0, 0.0, 0.0,
        )  # fmt: skip
        mean = np.zeros(self.size)
        mean[: self.shared_end] = np.concatenate((design.alpha, shared))
        for term in ('masses', 'springs', 'damping'):
            mean[self.cells[term]] = 1.0
        return mean

    def specimen(self, x: Array) -> Specimen:
        """Return the element that a vector describes.

        Raises:
            DesignError: There is no such element.
        """
        D_s1, D_s2, c = map(float, x[self.design.N : self.design.N + 3])
        if self.design.law is None:
            a, b = solve_potential(self.design, D_s1, D_s2, c)
            law: dict[str, Any] = {'a': a, 'b': b, 'c': c}
        else:
            law = {'law': stretch_law(self.design, D_s1, D_s2, c)}
        design = replace(
            self.design, **law, eta=float(x[self.shared('eta')]),
            s_max=self.design.s_min * float(x[self.shared('substrate_ratio')]),
            j_0=float(x[self.shared('j_0')]), substrate='rigid',
        )  # fmt: skip
        return Specimen(
            design,
            alpha_factor=x[self.alpha] / design.alpha,
            mass=self.cell_values(x, 'masses', 1.0),
            offset=self.cell_values(x, 'offsets', 0.0),
            k_r_factor=self.cell_values(x, 'springs', 1.0),
        )

    def law_rates(self, x: Array) -> Array:
        """Return how the potential depends on D_s1, D_s2 and c, shape (3, 3).

        Rows: its two derivatives in a run (`tangent.Phases`, `tangent.Spline`), and where it
        begins, downwards.
        """
        at = x[self.design.N : self.design.N + 3]
        if self.design.law is not None:
            way, before = at[1] - at[0], self.design.D_s1 - self.design.law.origin
            share = before / (self.design.D_s2 - self.design.D_s1)
            return np.array([
                [-1.0 / way, 1.0 / way, 0.0], [0.0, 0.0, 1.0], [-1.0 - share, share, 0.0]
            ])  # fmt: skip
        step = 1e-6
        up, down = (
            np.array([solve_potential(self.design, *(at + way * one)) for one in np.eye(3)])
            for way in (step, -step)
        )
        rates = (up - down).T / (2.0 * step)
        return np.concatenate((rates, [[0.0, 0.0, 1.0]]))

    def substrate_rates(self, x: Array) -> Array:
        """Return the derivatives of V_j per V_N by substrate ratio and j_0, shape (2, N)."""
        step = 1e-4
        x, ratio = x.copy(), self.shared('substrate_ratio')
        x[ratio] = max(x[ratio], 1.0 + step)  # below 1 there is no element
        rows = []
        for name in ('substrate_ratio', 'j_0'):
            ends = []
            for sign in (1.0, -1.0):
                moved = x.copy()
                moved[self.shared(name)] += sign * step
                ends.append(self.specimen(moved).strain_shape)
            rows.append((ends[0] - ends[1]) / (2.0 * step))
        return np.array(rows)

    def end_values(self, x: Array, what: str) -> Array:
        """Return the zero, gain or drive of both transducers, shape (2,)."""
        return x[[self.shared(f'{what}_{end}') for end in End]]


def solve_potential(design: Design, D_s1: float, D_s2: float, c: float) -> tuple[float, float]:
    """Return a and b of the potential with these ground states and this c."""
    y1, y2 = D_s1 + c, D_s2 + c
    first, second = (2.0 * math.pi * (design.phase + k) / y for k, y in enumerate((y1, y2)))
    b = (second - first) / (y2 * y2 - y1 * y1)
    return float(first - b * y1 * y1), float(b)


def stretch_law(design: Design, D_s1: float, D_s2: float, skew: float) -> Curve:
    """Return a design's law with other ground states, and its force skewed about them."""
    law, first, second = design.law, design.D_s1, design.D_s2
    assert law is not None
    factor = (D_s2 - D_s1) / (second - first)
    low, high = (D_s1 + factor * (each - first) for each in (law.low, law.high))
    force = np.array(law.force) + skew * np.array(skew_law(design).force)
    return replace(law, low=low, high=high, force=tuple(force.tolist()))


def skew_law(design: Design) -> Curve:
    """Return the derivative of a design's law by its skew.

    A skew of 1 % makes the force 0.5 % stronger about the second ground state and as much weaker
    about the first, in proportion between and beyond; the ground states stay.
    """
    law = design.law
    assert law is not None
    D = np.linspace(law.low, law.high, len(law.force))
    share = (D - design.D_s1) / (design.D_s2 - design.D_s1) - 0.5
    return replace(law, force=tuple((share * np.array(law.force)).tolist()))
