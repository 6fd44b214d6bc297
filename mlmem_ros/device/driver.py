# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What an instrument requires of the element behind it: a simulation, or a real one.

`docs/drivers.md` shows how to write one.
"""

from __future__ import annotations

from abc import ABC, abstractmethod

from ..physics import Chain, HeldCell
from ..physics.potential import Array


class Driver(ABC):
    """Strains an element, holds one of its ends, and measures both, sample by sample.

    The constructor opens it: the class is called with design, settings and `device.address`, and
    raises `DriverError` or `SettingsError` if that fails. It is opened, advanced and closed in its
    own thread (see `Watched`); its other methods are called while that thread waits.

    Only a simulation has a `chain`, which field, wall, views, state hashes, replay, restored
    content, material faults and a shaken base require.

    Attributes:
        dt: Time between samples, in time units; a tick has a whole number of samples.
        nodes: Times of the set-points in a sample, as increasing fractions of it, the last one 1.
            A real element takes one set-point at the end of each sample.
        lag: Ticks by which samples lag behind their set-points.
        strains: Whether it can strain the element; an actuator that is not there moves nothing.
        own_clock: Whether `advance` waits for its own clock, which then paces all ticks.
        interrupted: Whether sampling was interrupted within, or just before, the samples that
            `advance` returned last: an echo cannot be measured across a break.
        V_N: The last set-point of the substrate's end displacement.
        chain: The simulated material, or None for a real one.
    """

    dt: float
    nodes: tuple[float, ...] = (1.0,)
    lag: int = 0
    strains: bool = True
    own_clock: bool = False
    interrupted: bool = False
    V_N: float = 0.0
    chain: Chain | None = None

    @abstractmethod
    def advance(
        self,
        V_N: Array,
        held_cell: HeldCell | None = None,
        shake: Array | None = None,
        looks: int = 1,
    ) -> Array:
        """Apply the set-points of whole ticks, and return their samples.

        All lengths are in cells. `lag` ticks lie between a set-point and its sample; the first
        samples are those of an element at rest.

        Args:
            V_N: Displacement of the substrate's end, shape (n nodes,) for n samples.
            held_cell: An end cell that is held for the first set-points, then released.
            shake: Acceleration of the base; a real element ignores it.
            looks: Number of ticks.

        Returns:
            Displacements of the first and the last cell after every sample, shape (2, n).

        Raises:
            DriverError: The element cannot be reached, or returns impossible values.
            StateError: The simulated material cannot continue; it is unchanged.
        """

    def at_rest(self, V_N: float) -> bool:
        """Return whether nothing changes while the substrate's end stays at a displacement.

        It is asked while nothing else moves the element. If it rests, `pass_by` is called for
        ticks instead of `advance`.
        """
        return False

    def pass_by(self, steps: int) -> None:  # noqa: B027
        """Let the time of some samples pass for an element that rests."""

    @abstractmethod
    def end(self, site: int) -> float:
        """Return the last known displacement of an end: site 1 or N."""

    def force(self) -> float | None:
        """Return the force on the substrate's end in k_r cells, or None if it is not measured."""
        return None

    def health(self) -> dict[str, float | str]:
        """Return values for diagnostics, by name."""
        return {}

    def close(self) -> None:  # noqa: B027
        """Release the element, with zero strain; it may be called twice."""
