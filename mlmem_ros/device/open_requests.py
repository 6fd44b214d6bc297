# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Requests whose commands an element carries out: from the tick they begin with to the answer."""

from __future__ import annotations

from collections.abc import Callable

from ..procedures import Abort
from .commands import Command
from .element import MemoryElement
from .errors import Refused
from .loop_statistics import LoopStatistics
from .mailbox import Asked
from .request import Cancel

Stamped = tuple[int, Command]
"""A command and the tick at which it took effect."""

Settle = Callable[[Asked], None]
"""Called in the loop's thread, between two ticks, when a request's procedure has ended."""

CANCELED = 'canceled by its client'


class OpenRequests:
    """Applies commands to an element, and remembers the requests whose procedures run."""

    def __init__(self, element: MemoryElement, statistics: LoopStatistics, settle: Settle) -> None:
        """Begin without requests; `statistics` counts the refused."""
        self._element = element
        self._statistics = statistics
        self._settle = settle
        self._open: list[Asked] = []

    def apply(self, request: Asked) -> list[Stamped]:
        """Apply a command; return it with its tick if it is accepted."""
        command = request.asked
        if isinstance(command, Cancel):
            if not self._element.runs(command.of.run):
                request.settle(None)
                return []
            command = Abort(CANCELED)
        try:
            request.run = self._element.apply(command)
        except Refused as refusal:
            self._statistics.refused += 1
            request.refuse(refusal)
            return []
        except Exception as failure:
            request.refuse(failure)
            raise
        if request.run is not None:
            self._open.append(request)
        else:
            request.settle(None)
        return [(self._element.ticks, command)]

    def settle(self) -> None:
        """Answer those whose procedures have ended, at once or later."""
        for request in [each for each in self._open if each.outcome is not None]:
            self._open.remove(request)
            self._settle(request)

    def refuse(self, refusal: Refused) -> None:
        """Refuse all."""
        for request in self._open:
            request.refuse(refusal)
