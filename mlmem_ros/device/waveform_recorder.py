# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What both ends do after a pulse, recorded sample by sample."""

from __future__ import annotations

import numpy as np

from ..physics.potential import Array
from .end import End
from .settings import ProbeSettings
from .shot import Shot


class WaveformRecorder:
    """Records both ends from now on, where a pulse begins.

    Attributes:
        end: The driven end.
        probe: The pulse.
    """

    def __init__(self, end: End, probe: ProbeSettings, before: Array, lag: int) -> None:
        """Begin with the samples that are taken `lag` ticks from now.

        `before` holds displacements of both ends before the pulse, shape (2, n).
        """
        self.end, self.probe = end, probe
        self._rest, self._unrest = before.mean(axis=1), float(before.std(axis=1).max())
        self._late = lag
        self._parts: list[Array] = []
        self._broken = False

    def take(self, ends: Array, ticks: int, interrupted: bool) -> None:
        """Take the samples of ticks, shape (2, m).

        From an interruption on, when they were taken is not known: they are NaN.
        """
        late = min(self._late, ticks)
        self._late -= late
        self._broken |= interrupted
        part = ends[:, late * ends.shape[1] // ticks :]
        self._parts.append(np.full_like(part, np.nan) if self._broken else part)

    def shot(self, wall: float, strain: float, dt: float) -> Shot:
        """Return the pulse and all samples so far; see `Shot`."""
        probe, samples = self.probe, np.concatenate((np.empty((2, 0)), *self._parts), axis=1)
        return Shot(
            self.end, probe.omega_c, probe.A, probe.sigma, wall, strain, dt, self._rest, samples,
            self._unrest,
        )  # fmt: skip
