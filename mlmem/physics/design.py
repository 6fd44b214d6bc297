# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The design of an element: every symbol of Table I as one immutable value, and the paper's two.

All lengths are in lattice constants, times in sqrt(m / k_r), stiffnesses in k_r.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import MISSING, asdict, dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import DesignError, ErrorCode
from ..schema import Problem, describe_field, find_problems, make_field_factory
from .curve import Curve
from .potential import Potential
from .values import Array

if TYPE_CHECKING:
    from .specimen import Material

_cells = make_field_factory('cells', 2, 100_000)
_stiffness = make_field_factory('k_r', 1e-9, 1e9)


class DefaultPhase(int):
    """A phase that follows from the law, because nobody chose one."""


@dataclass(frozen=True)
class Design:
    """Two coupled chains, validated on creation; `require_memory` says whether they are a memory.

    Sites are counted from 1 as in the paper; arrays hold site j at index j - 1.

    Attributes:
        law: The on-site law where it is not the paper's formula, with energies in units of d; a, b
            and c then have no meaning.
        phase: By default 1 with the paper's potential, and 0, the lowest, with a law; a copy with
            another law takes the default of that law.

    Raises:
        DesignError: A value is out of range, or values contradict each other.
    """

    N: int = describe_field(MISSING, 'number of unit cells', low=3, high=100_000)
    gamma: float = describe_field(
        MISSING, 'gradient of the on-site potential, per cell', low=-1.0, high=1.0
    )
    beta: float = describe_field(MISSING, 'anomaly of the defect cells', low=-1.0, high=10.0)
    J: int = _cells(MISSING, 'cells per level: period of the defects')
    J_s: int = _cells(MISSING, 'period of the substrate stiffness')
    j_0: float = _cells(MISSING, 'site of least substrate stiffness', low=-1e6, high=1e6)
    d: float = describe_field(
        MISSING, 'half the barrier height of the potential', low=1e-9, high=1e3
    )
    a: float = describe_field(
        0.2582, 'linear phase coefficient of the potential', low=1e-9, high=1e3
    )
    b: float = describe_field(
        0.0172, 'cubic phase coefficient of the potential', low=-1e3, high=1e3
    )
    c: float = describe_field(7.4489, 'offset of the potential', low=-1e6, high=1e6)
    s_min: float = _stiffness(1000.0, 'least substrate stiffness')
    s_max: float = _stiffness(3000.0, 'greatest substrate stiffness')
    eta: float = describe_field(
        1 / 250, 'on-site viscous damping', unit='1/time', low=0.0, high=10.0
    )
    phase: int = describe_field(
        None, 'ground state that is the inactive phase s1; s2 is the next one', low=-100, high=100
    )
    tail: int = _cells(
        0,
        'cells at the right end without defects, so that the last echo is clear of its pulse',
        low=0,
    )
    substrate: str = describe_field(
        'rigid', 'substrate model: Eq. (1a) alone, or with Eq. (1b)', choices=('rigid', 'elastic')
    )
    profile: str = describe_field(
        '',
        "factors on the potential of a defect's cells, an odd number centred on its site, in "
        'place of 1 + beta; empty: one cell',
        words='factors from 0.01 to 100',
        word=lambda text: 0.01 <= float(text) <= 100.0,
    )
    rise: float = describe_field(
        0.0,
        'relative rise of the potential beyond the last level, beginning half a level beyond '
        'its defect',
        low=0.0,
        high=10.0,
    )
    friction: float = describe_field(
        0.0, 'dry friction of every cell', unit='k_r cells', low=0.0, high=0.1
    )
    law: Curve | None = None

    def __post_init__(self) -> None:
        if self.phase is None or isinstance(self.phase, DefaultPhase):
            object.__setattr__(self, 'phase', DefaultPhase(self.usual_phase))
        if not isinstance(self.law, Curve | None):
            expected = 'a Curve, such as Potential.from_function returns, or None'
            raise DesignError.out_of_range('law', self.law, expected)
        for problem in find_problems(self):
            raise DesignError.out_of_range(*problem)
        for conflict in self._find_conflicts():
            raise DesignError(ErrorCode.CONFLICT, *conflict)
        for n in (self.phase, self.phase + 1):
            try:
                self.potential.ground_state(n)
            except DesignError as error:
                states = f'ground states {self.phase} and {self.phase + 1}'
                raise DesignError.of_error(error, place=states) from error

    @property
    def usual_phase(self) -> int:
        """The phase of a design that names none: that of the paper, or the lowest of a law."""
        return 1 if self.law is None else 0

    def require_memory(self) -> None:
        """Make sure that the chains are a memory: levels fit, and the substrate stays straight.

        Raises:
            DesignError: They are not; a simulation without a device still takes them.
        """
        if (last := self.N - self.tail - 1) < self.J:
            expected = f'at most N - tail - 1 = {last}, or no level fits'
            raise DesignError(ErrorCode.CONFLICT, 'J', self.J, expected)
        stiffest = max(1.0, self.k_s1, self.k_s2)
        if self.s_min < (least := 10.0) * stiffest:  # the paper's >>
            expected = (
                f'far above max(k_r, k_s) = {stiffest:.4g} (at least {least:g} '
                'times), or the wall strains the substrate'
            )
            raise DesignError(ErrorCode.CONFLICT, 's_min', self.s_min, expected)

    def _find_conflicts(self) -> Iterator[Problem]:
        """Yield the values that do not fit others."""
        factors = len(self.defect_factors)
        if self.profile and self.beta:
            yield Problem('beta', self.beta, '0 with a profile, which stands in its place')
        elif factors % 2 == 0 or factors > self.J:
            expected = f'an odd number of factors, at most J = {self.J}'
            yield Problem('profile', factors, expected)
        elif self.beta <= -1.0:
            yield Problem('beta', self.beta, 'greater than -1')
        elif self.alpha.min() <= 0.0:
            expected = (
                f'above -1/N = {-1 / self.N:.4g}, or alpha, the amplification of the potential, '
                'is not positive everywhere'
            )
            yield Problem('gamma', self.gamma, expected)
        if self.law is not None and any(
            getattr(self, name) != type(self).__dataclass_fields__[name].default for name in 'abc'
        ):
            expected = "left out with a law, as b and c: they are of the paper's formula"
            yield Problem('a', self.a, expected)
        if self.s_max < self.s_min:
            yield Problem('s_max', self.s_max, f'at least s_min = {self.s_min:g}')

    def as_dict(self) -> dict[str, Any]:
        """Return it as plain values; optional fields only where they are not the defaults."""
        values = asdict(self) | {'phase': int(self.phase)}
        for name in ('profile', 'rise', 'friction', 'law'):
            if values[name] == getattr(type(self), name):
                del values[name]
        return values

    # --- the potential -------------------------------------------------------------------

    @cached_property
    def potential(self) -> Potential | Curve:
        """The on-site potential, before its amplification alpha_j."""
        if self.law is not None:
            return replace(self.law, d=self.law.d * self.d)
        return Potential(self.a, self.b, self.c, self.d)

    @cached_property
    def D_s1(self) -> float:
        """Configuration of the inactive phase (blank cells)."""
        return self.potential.ground_state(self.phase)

    @cached_property
    def D_s2(self) -> float:
        """Configuration of the active phase."""
        return self.potential.ground_state(self.phase + 1)

    @cached_property
    def D_barrier(self) -> float:
        """Configuration of the barrier top between the phases, which defines a wall's position."""
        return self.potential.barrier(self.phase)

    @cached_property
    def wells(self) -> tuple[float, float]:
        """Configurations between which a cell is in one of the two phases, barriers included."""
        return self.potential.wells(self.phase, self.phase + 1)

    @cached_property
    def k_s1(self) -> float:
        """On-site stiffness of the inactive phase."""
        return float(self.potential.stiffness(self.D_s1))

    @cached_property
    def k_s2(self) -> float:
        """On-site stiffness of the active phase."""
        return float(self.potential.stiffness(self.D_s2))

    @cached_property
    def holding_force(self) -> float:
        """Greatest steady, uniform force that drives no cell over a barrier.

        The weakest cell of the gradient decides; a soft defect is held by its neighbours.
        """
        low, high = self.wells
        edges = (low, self.D_s1, self.D_barrier, self.D_s2, high)
        ways = [np.linspace(*each, 1001) for each in itertools.pairwise(edges)]
        weakest = min(float(np.abs(self.potential.slope(way)).max()) for way in ways)
        return weakest * min(1.0, 1.0 + self.gamma * self.N)

    # --- the element ---------------------------------------------------------------------

    @cached_property
    def sites(self) -> Array:
        """Site numbers 1 ... N, shape (N,)."""
        return _freeze_array(np.arange(1, self.N + 1, dtype=np.float64))

    @cached_property
    def defect_factors(self) -> tuple[float, ...]:
        """Factors on the potential of the cells of a defect, its site in the middle."""
        return tuple(map(float, self.profile.split())) or (1.0 + self.beta,)

    @cached_property
    def alpha(self) -> Array:
        """Amplification of the on-site potential, shape (N,)."""
        defect = (self.sites % self.J == 0) & (self.sites <= self.N - self.tail)
        anomaly, half = np.ones(self.N), len(self.defect_factors) // 2
        for center in np.flatnonzero(defect):
            for cell, factor in enumerate(self.defect_factors, int(center) - half):
                if 0 <= cell < self.N:
                    anomaly[cell] = factor
        if self.rise:
            anomaly[self.sites > self.defect_site(self.levels - 1) + self.J / 2.0] *= (
                1.0 + self.rise
            )
        return _freeze_array((1.0 + self.gamma * self.sites) * anomaly)

    @cached_property
    def s(self) -> Array:
        """Substrate stiffness s_{j+1/2} of Eq. (2), shape (N - 1,)."""
        return _freeze_array(stiffness_profile(self, self.sites[:-1]))

    @cached_property
    def strain_shape(self) -> Array:
        """Quasi-static substrate displacement V_j for a unit V_N (V_1 = 0), shape (N,)."""
        return _freeze_array(strain_shape(self.s))

    @property
    def levels(self) -> int:
        """Number p of levels; a defect at the very end (j = N - tail) does not count."""
        return (self.N - self.tail - 1) // self.J

    @property
    def cells(self) -> tuple[int, int, int, int]:
        """Number of cells, and the places of defects and substrate: N, J, J_s, tail."""
        return self.N, self.J, self.J_s, self.tail

    @property
    def bits(self) -> int:
        """Bits per element, floor(log2 p)."""
        return self.levels.bit_length() - 1

    def defect_site(self, level: int) -> int:
        """Return the site of the defect that pins the wall of a level (0 ... p - 1)."""
        return (level + 1) * self.J

    def is_freed_by_compression(self, level: int) -> bool:
        """Return whether compression, rather than tension, frees the wall at a level.

        Compression draws a wall to the next maximum of the substrate stiffness, tension to the
        next minimum; so it depends on which of them comes first (Fig. 2a).
        """
        ahead = (self.defect_site(level) - self.j_0) % self.J_s
        return ahead < self.J_s / 2.0

    def code(self, level: int) -> str:
        """Return the binary code of a level, `bits` wide where it fits (Fig. 1a)."""
        return format(level, f'0{max(self.bits, 1)}b')

    def end_displacement(self, strain: float) -> float:
        """Return V_N for a strain Delta l / l of the element, l = N (tension positive)."""
        return strain * self.N


EXPECTED_MATERIAL = 'a design, a specimen, or what has one: a loaded element, or element.chain'
"""What a `Material` must be, in words."""


def as_design(material: Material) -> Design:
    """Return the design of a material; that of a design is itself.

    Raises:
        DesignError: It is no material.
    """
    design = getattr(material, 'design', material)
    if not isinstance(design, Design):
        raise DesignError.out_of_range('material', material, EXPECTED_MATERIAL)
    return design


def stiffness_profile(design: Design, j: Array) -> Array:
    """Return the substrate stiffness s_{j+1/2} of Eq. (2) at any real j."""
    half = design.J_s / 2.0
    distance = np.abs(np.mod(j - design.j_0 - half, design.J_s) - half)
    return np.asarray(design.s_min + (design.s_max - design.s_min) * distance / half)


def strain_shape(s: Array) -> Array:
    """Return the displacement V_j of springs in a row, stiffness s, for V_1 = 0 and V_N = 1."""
    compliance = np.concatenate(([0.0], np.cumsum(1.0 / s)))
    return np.asarray(compliance / compliance[-1])


def _freeze_array(array: Array) -> Array:
    array.flags.writeable = False
    return array


CASE_I = Design(N=200, gamma=-2.5e-4, beta=-1 / 5, J=100, J_s=200, j_0=81.0, d=0.0061)
"""Table I, Case I: the element of the energy landscape, Fig. 2. One defect in its middle."""

CASE_II = Design(N=225, gamma=-4e-4 / 3, beta=-1 / 20, J=25, J_s=50, j_0=17.0, d=0.0380)
"""Table I, Case II: the eight-level memory, Figs. 3 to 5."""
