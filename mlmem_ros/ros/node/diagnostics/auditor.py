# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Audits the energy of a tick after the fact, outside of the loop's thread."""

from __future__ import annotations

from dataclasses import dataclass

from ....physics import Chain, Drive, Specimen
from ....physics.energy import Budget, audit
from ....physics.potential import Array

MOST = 20_000
"""Cells times steps that are audited: a whole tick of the paper's elements over a rigid
substrate, which takes 1.5 ms."""


@dataclass(frozen=True)
class _Tick:
    """A tick that was run: the state it began with, and what drove it."""

    state: Array
    V_N: float
    steps_done: int
    specimen: Specimen
    inputs: tuple[Array, Drive | None, Array | None]


class Auditor:
    """Runs a tick again on a twin of the chain, where books are kept.

    `begin` and `end` are called in the loop's thread, before and after a tick, and only copy
    the state; `budget` computes in any other.
    """

    def __init__(self) -> None:
        self._begun: tuple[Chain, Array, float, int] | None = None
        self._tick: _Tick | None = None
        self._twin: Chain | None = None

    def begin(self, chain: Chain) -> None:
        """Remember how a tick begins."""
        self._begun = chain, chain.state(), chain.V_N, chain.steps_done

    def end(self, chain: Chain) -> bool:
        """Remember what the tick was driven by.

        Returns:
            Whether it was just one, or several that were run as one.
        """
        if self._begun is None:
            return False
        (begun, *state, steps), self._begun = self._begun, None
        done = len(chain.inputs[0]) // chain.integrator.substeps
        if begun is not chain or chain.steps_done != steps + done:
            return False
        self._tick = _Tick(*state, steps, chain.specimen, chain.inputs)
        return True

    def budget(self, chain: Chain) -> Budget | None:
        """Return the budget of the newest tick, or None where it has been told.

        Args:
            chain: The chain, for its step size: its state may be changing meanwhile.
        """
        tick, self._tick = self._tick, None
        if tick is None:
            return None
        twin = self._twin
        kind = chain.design, chain.dt, chain.integrator
        if twin is None or (twin.design, twin.dt, twin.integrator) != kind:
            twin = self._twin = Chain(*kind)
        twin.restore(tick.state, V_N=tick.V_N, steps_done=tick.steps_done)
        if twin.specimen is not tick.specimen:
            twin.become(tick.specimen)
        return audit(twin, *tick.inputs, most=max(1, MOST // chain.design.N))
