# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What an instrument asks of what it strains and listens to: a simulation, or a real element.

`docs/drivers.md` shows how to write one.
"""

from __future__ import annotations

from abc import ABC, abstractmethod

from ..physics import Chain, Drive
from ..physics.potential import Array


class Driver(ABC):
    """Strains an element, holds an end of it, and tells what both ends do, sample by sample.

    It is made open: its class is called with design, settings and `device.address`, and raises
    `DriverError` or `SettingsError` where that does not do. It is opened, played and closed in a
    thread of its own (see `Watched`); what it tells is asked for while that waits.

    What only a simulation can tell or suffer hangs on `chain`: field, wall and views, state
    hashes and replay, restoring a content, faults of the material, a base that is shaken.

    Attributes:
        dt: Time from sample to sample, in time units; a tick has a whole number of samples.
        nodes: The times in a sample at which it takes a set-point, as shares of the sample:
            rising, the last one 1. A real element takes one at the end of each.
        lag: Ticks by which samples come later than their set-points.
        own_clock: Whether `advance` waits for a clock of its own, which then paces all ticks.
        interrupted: Whether the element was left alone within, or just before, the samples that
            `advance` returned last: an echo cannot be heard across that.
        V_N: Displacement of the substrate's end that was asked for last.
        chain: The simulated material, or None for a real one.
    """

    dt: float
    nodes: tuple[float, ...] = (1.0,)
    lag: int = 0
    own_clock: bool = False
    interrupted: bool = False
    V_N: float = 0.0
    chain: Chain | None = None

    @abstractmethod
    def advance(
        self, V_N: Array, drive: Drive | None = None, shake: Array | None = None, looks: int = 1
    ) -> Array:
        """Play the set-points of whole ticks, and return as many samples.

        All lengths are in cells, `lag` ticks lie between a set-point and its sample: the first
        samples ever are those of an element at rest.

        Args:
            V_N: Displacement of the substrate's end, shape (n nodes,) for n samples.
            drive: An end cell that is held for the first set-points, then let go.
            shake: Acceleration of the base, which a real element feels by itself.
            looks: How many ticks that is.

        Returns:
            Displacements of the first and the last cell after every sample, shape (2, n).

        Raises:
            DriverError: The element cannot be reached, or says what cannot be.
            StateError: The simulated material cannot go on; it is as it was before.
        """

    @abstractmethod
    def end(self, site: int) -> float:
        """Return the last known displacement of an end: site 1 or N."""

    def force(self) -> float | None:
        """Return the force on the substrate's end in k_r cells, or None where none is measured."""
        return None

    def health(self) -> dict[str, float | str]:
        """Return what diagnostics shall tell of it, by name."""
        return {}

    def close(self) -> None:  # noqa: B027
        """Let the element go, with no strain on it; it may be called twice."""
