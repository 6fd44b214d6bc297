# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The units of an element in SI, which messages use; a device computes in cells."""

from __future__ import annotations

from dataclasses import dataclass, field

from ..physics import CASE_II, Design
from .settings import ScaleSettings


@dataclass(frozen=True)
class Units:
    """The units of an element of some size and scale.

    Attributes:
        design: The element.
        scale: The dimensionless units in SI.
    """

    design: Design = CASE_II
    scale: ScaleSettings = field(default_factory=ScaleSettings)

    @property
    def length(self) -> float:
        """One lattice constant, in m."""
        return self.scale.length

    @property
    def elongation(self) -> float:
        """Displacement of the substrate's end for a strain of 1, in m."""
        return self.scale.length * self.design.end_displacement(1.0)

    @property
    def speed(self) -> float:
        """One lattice constant per time unit, in m/s."""
        return self.scale.length / self.scale.time

    @property
    def acceleration(self) -> float:
        """One lattice constant per time unit squared, in m/s^2."""
        return self.scale.acceleration

    @property
    def force(self) -> float:
        """k_r times one lattice constant, in N."""
        return self.scale.stiffness * self.scale.length
