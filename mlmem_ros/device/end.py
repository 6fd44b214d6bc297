# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The two ends of an element, and what belongs to each of them."""

from __future__ import annotations

from enum import Enum

from ..physics import Design
from .settings import ProbeSettings, Settings


class End(str, Enum):
    """An end at which an element is driven and probed; its value is used in files and answers."""

    LEFT = 'left'
    RIGHT = 'right'

    def __str__(self) -> str:
        return self.value

    @property
    def row(self) -> int:
        """Its row in arrays of both ends, shape (2, ...)."""
        return 0 if self is End.LEFT else 1

    @property
    def opposite(self) -> End:
        """The other end."""
        return End.RIGHT if self is End.LEFT else End.LEFT

    def site(self, design: Design) -> int:
        """Return its cell: 1 or N."""
        return 1 if self is End.LEFT else design.N

    def rest(self, design: Design) -> float:
        """Return the ground state in front of a wall: active at the left, otherwise inactive."""
        return design.D_s2 if self is End.LEFT else design.D_s1

    def k_s(self, design: Design) -> float:
        """Return the on-site stiffness of that state, in which its waves travel."""
        return design.k_s2 if self is End.LEFT else design.k_s1

    def distance(self, design: Design, level: int) -> int:
        """Return how far a wall at a level is, in cells."""
        return abs(design.defect(level) - self.site(design))

    def cell(self, design: Design, distance: float) -> float:
        """Return the place of a reflector that is at some distance from it."""
        return 1.0 + distance if self is End.LEFT else design.N - distance

    def displacement(self, design: Design, strain: float) -> float:
        """Return how far a substrate strain moves it."""
        return 0.0 if self is End.LEFT else design.end_displacement(strain)

    def probe(self, settings: Settings) -> ProbeSettings:
        """Return its pulse and detector."""
        return settings.probe if self is End.LEFT else settings.probe_right
