# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Compares the last read of every procedure with the forecast of a twin."""

from __future__ import annotations

import threading
from typing import Any

from mlmem.element_file import Element
from mlmem.physics import DesignError, Integrator, StateError
from mlmem.procedure_table import PROCEDURES
from mlmem_ros.contract.streams import ReadShot

from .watching import Comparison, Residuals, locate_wall


class ResidualMonitor:
    """Takes the waveforms of reads as they come, and compares them once their procedure has ended;
    one thread takes pulses while another compares.

    Attributes:
        text: What has changed, in words; empty as long as all is as forecast.
        compared: Number of reads that were compared.
        skipped: Number of those that were not: disturbed, or too soon after something else.
        last: The last comparison, or None.
    """

    def __init__(self, twin: Element, integrator: Integrator | None) -> None:
        """Monitor an element; the arguments are those of `Residuals`."""
        self.twin, self.text = twin, ''
        self.compared = self.skipped = 0
        self.last: Comparison | None = None
        self._residuals = Residuals(twin, integrator)
        self._read: list[ReadShot] = []  # the pulses of one read, which end at the same tick
        self._lock = threading.Lock()
        self._wall: float | None = None

    def take_shot(self, taken: ReadShot) -> None:
        """Take a pulse of a read; one of a later tick begins another read."""
        with self._lock:
            if self._read and self._read[0].tick != taken.tick:
                self.skipped += 1
                self._read = []
            self._read.append(taken)

    def end_procedure(self, name: str) -> None:
        """Compare the last read of a procedure, if it had one."""
        with self._lock:
            read, self._read = self._read, []
        if not read:
            return
        moved = name in PROCEDURES and PROCEDURES[name].changes
        self._wall = locate_wall(self.twin.design, read[-1].level, self._wall, moved)
        shots = sorted((each.shot for each in read), key=lambda shot: -shot.samples.shape[1])
        disturbed = any(each.disturbed for each in read)
        if self._wall is None or disturbed or not self._residuals.was_at_rest(shots):
            self.skipped += 1
            return
        try:
            self.last = self._residuals.compare(shots, self._wall)
        except (StateError, DesignError) as error:
            self.text = f'the twin has no forecast for a wall at {self._wall:.0f}: {error}'
        else:
            self.text = self.last.text
            self.compared += 1

    def values(self) -> dict[str, Any]:
        """Return values for diagnostics, by name; alpha and its deviation over the design's."""
        made = self.twin.specimen
        nominal = self.twin.design.alpha
        found: dict[str, Any] = {
            'compared': self.compared, 'skipped': self.skipped,
            'alpha': (made.alpha / nominal).tolist(),
            'alpha_std': (self.twin.alpha_std / nominal).tolist(),
        }  # fmt: skip
        if (last := self.last) is not None:
            left, right = map(float, last.residual)
            found |= {'chi2': last.chi2, 'residual_left': left, 'residual_right': right}
            if (change := last.change) is not None:
                found |= {
                    'changed': change.name, 'site': change.site, 'amount': change.amount,
                    'deviation': change.deviation,
                }  # fmt: skip
        return found
