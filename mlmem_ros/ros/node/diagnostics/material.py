# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The material: stability, walls, and the books of its energy."""

from __future__ import annotations

from typing import Any

from ....device import Loop, MemoryElement
from ....physics import Specimen, stable_step, walls
from ....physics.energy import energy
from .auditor import Auditor
from .health import OK, WARN, Component, Health

AUDIT_EVERY = 5
"""Reports between two audits."""

LARGEST_IMBALANCE = 0.25
"""Residual over exchanged energy up to which it is the integrator's own: its numerical damping of
waves at the probe's carrier gives 0.15 where nothing else moves."""


LEAST_EXCHANGE = 1e-12
"""Energy that a tick exchanges, in k_r (lattice constant)^2, below which its residual is rounding
and not judged: that of a cell that swings by a millionth. An echo is a thousandth at least."""


class MaterialComponent(Component):
    """Warns when energy is lost or made, or when a resting element has more than one wall."""

    name = 'material'

    def __init__(self) -> None:
        self._auditor = Auditor()
        self._values: dict[str, Any] = {}
        self._books: dict[str, Any] = {}
        self._idle = False
        self._since_audit = AUDIT_EVERY
        self._judged: tuple[Specimen | None, float] = None, 0.0

    def before_tick(self, element: MemoryElement) -> None:
        """Let the books of the tick begin, where they are due: they are the dearest of all."""
        if self._since_audit >= AUDIT_EVERY:
            self._auditor.begin(element.chain)

    def after_tick(self, element: MemoryElement) -> None:
        """Take what a tick has led to."""
        chain = element.chain
        self._since_audit = 1 if self._auditor.end(chain) else self._since_audit + 1
        self._idle = element.released
        parts = energy(chain)
        if self._judged[0] is not chain.specimen:
            limit = stable_step(chain.specimen, chain.integrator)
            self._judged = chain.specimen, 1.0 - chain.dt / limit
        self._values = {
            'stability_margin': self._judged[1],
            'dt': chain.dt,
            'walls': len(walls(element.design, chain.configuration)),
            'kinetic_energy': parts.kinetic,
            'stored_energy': parts.total - parts.kinetic,
        }

    def health(self, loop: Loop) -> Health:
        """Return the state and, in k_r (lattice constant)^2, the books of one tick."""
        if (budget := self._auditor.budget(loop.element.chain)) is not None:
            self._books = {
                'energy_residual': budget.residual,
                'energy_exchanged': budget.exchanged,
                'energy_imbalance': (
                    budget.imbalance if budget.exchanged > LEAST_EXCHANGE else 0.0
                ),
            }
        values = self._values | self._books
        if (imbalance := self._books.get('energy_imbalance', 0.0)) > LARGEST_IMBALANCE:
            text = f'the energy budget is off by {imbalance:.2g} of what is exchanged'
            return Health(WARN, text, values)
        if self._idle and values['walls'] > 1:
            return Health(WARN, f'{values["walls"]} walls: erase before writing', values)
        return Health(OK, 'stable', values)
