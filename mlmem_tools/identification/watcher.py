# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Watches an element by its twin, in a thread of its own: no tick waits for a forecast."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from mlmem import EchoReceived, Event, MemoryElement, Outcome
from mlmem.element_file import Element
from mlmem.instrument.end import Shot
from mlmem.physics import INTEGRATORS, DesignError, StateError
from mlmem.procedure_table import PROCEDURES
from mlmem_ros.host.worker import ThrottledLog, Worker

from .watching import MAX_WATCHED_CELLS, Comparison, Residuals, locate_wall


class Watcher:
    """Hands every clean read to a worker that compares it with its forecast.

    A read that comes while another is compared is left out. A register compares every read with
    its twin's forecast by itself.

    Attributes:
        text: What has changed, in words; empty as long as all is as forecast.
        skipped: Number of those that were not: disturbed, or too soon after something else.
    """

    def __init__(self, twin: Element, element: MemoryElement, log: ThrottledLog) -> None:
        integrator = INTEGRATORS[element.settings.time.integrator] if element.simulated else None
        self.twin, self.text = twin, ''
        self.compared = self.skipped = 0
        self.last: Comparison | None = None
        self._element, self._design = element, element.design
        watched = not element.reader.holds_words and element.design.N <= MAX_WATCHED_CELLS
        self._residuals = Residuals(twin, integrator) if watched else None
        self._log = log
        self._worker = Worker('mlmem-twin', log)
        self._wall: float | None = None
        self._busy = False

    def hear(self, events: Sequence[Event]) -> None:
        """Take the events of a tick, in the loop's thread."""
        heard = [event for event in events if isinstance(event, EchoReceived)]
        shots = [event.echo.shot for event in heard if event.echo.shot is not None]
        if not heard or self._residuals is None:
            return
        ended = (event.procedure for event in events if isinstance(event, Outcome))
        procedure = PROCEDURES.get(next(ended, self._element.procedure))
        moved = procedure is not None and procedure.changes
        self._wall = locate_wall(self._design, heard[-1].reading, self._wall, moved)
        disturbed = any(event.echo.shaken or event.echo.spoiled for event in heard)
        shots.sort(key=lambda shot: -shot.samples.shape[1])
        known = self._wall is not None and len(shots) == len(heard)
        if self._busy or disturbed or not known or not self._residuals.was_at_rest(shots):
            self.skipped += 1
            return
        self._busy, wall = True, self._wall or 0.0
        self._worker.do(
            'comparing a read with its forecast', lambda: self._compare_read(shots, wall)
        )

    def _compare_read(self, shots: list[Shot], wall: float) -> None:
        assert self._residuals is not None
        try:
            self.last = self._residuals.compare(shots, wall)
        except (StateError, DesignError) as error:
            self._set_text(f'the twin has no forecast for a wall at {wall:.0f}: {error}')
        else:
            self._set_text(self.last.text)
            self.compared += 1
        finally:
            self._busy = False

    def _set_text(self, text: str) -> None:
        if text and not self.text:
            self._log.warning(f'twin: {text}')
        self.text = text

    def values(self) -> dict[str, Any]:
        """Return values for diagnostics, by name; alpha and its deviation over the design's."""
        nominal, made = self._design.alpha, self.twin.specimen
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

    def flush(self) -> bool:
        """Wait, but not for long, until the last read is compared; return whether it is."""
        return self._worker.wait()
