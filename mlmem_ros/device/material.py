# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What an instrument asks of its material: few methods, so that a rig may stand there."""

from __future__ import annotations

from typing import Protocol

from ..physics import Drive, Integrator
from ..physics.potential import Array


class Material(Protocol):
    """All that a tick asks of what is strained and listened to; `physics.Chain` is one.

    Attributes:
        dt: Time from sample to sample.
        integrator: Tells the times at which it wants strain, base and driven cell.
        V_N: Present displacement of the substrate's end.
    """

    dt: float
    integrator: Integrator
    V_N: float

    def advance(
        self,
        V_N: Array,
        drive: Drive | None = None,
        shake: Array | None = None,
        looks: int = 1,
    ) -> Array:
        """Advance by whole steps; return the displacements of both ends (see `Chain.advance`)."""

    def end(self, site: int) -> float:
        """Return the displacement of an end."""
