# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Requests whose commands an element carries out: from the tick they begin with to the answer.

One procedure runs at a time. The others wait for their turn, in order of arrival; all else passes
them.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

from .. import threads
from ..commands import Command
from ..element import MemoryElement
from ..errors import Refused
from ..procedure_table import Abort, Procedures
from ..rejections import ErrorCode
from .mailbox import Asked, Cancel
from .timetable import LoopStatistics

Stamped = tuple[int, Command]
"""A command and the tick at which it took effect."""

Resolve = Callable[[Asked], None]
"""Called in the loop's thread, between two ticks, when a request's procedure has ended."""


@dataclass
class OpenRequests:
    """Applies commands to an element, and remembers the requests whose procedures run.

    Attributes:
        element: What carries out the commands.
        statistics: Counts the refused.
        answer: Answers a request whose procedure has ended.
        put_back: Takes the request whose turn has come.
        most: How many may wait.
        waiting: Those that wait, in order of arrival.
    """

    element: MemoryElement
    statistics: LoopStatistics
    answer: Resolve
    put_back: Callable[[Asked], None]
    most: int
    waiting: deque[Asked] = field(default_factory=deque)
    _open: list[Asked] = field(default_factory=list)
    _next: Asked | None = None  # put back, and not taken up again

    def apply(self, request: Asked) -> list[Stamped]:
        """Apply a command; return it with its tick if it is accepted."""
        command = request.asked
        if request is self._next:
            self._next = None
        if isinstance(command, Cancel):
            why = 'canceled by its client'
            if command.of in self.waiting:
                self._drop_request(command.of, why)
            if not self.element.is_running(command.of.run):
                request.resolve(None)
                return []
            command = Abort(why)
        try:
            if self._must_wait(request):
                self.waiting.append(request)
                self._number_waiting()
                return []
            request.run = self.element.apply(command)
        except Refused as refusal:
            self._refuse_request(request, refusal)
            return []
        except Exception as failure:
            request.refuse(failure)
            raise
        if request.run is not None:
            self._open.append(request)
        else:
            request.resolve(None)
        return [(self.element.ticks, command)]

    def resolve(self) -> None:
        """Answer those whose procedures have ended, at once or later."""
        for request in [each for each in self._open if each.outcome is not None]:
            self._open.remove(request)
            self.answer(request)
        if self.waiting and self._next is None and not self.element.procedure:
            self.refuse_expired()
            if self.waiting:
                self._next = self.waiting.popleft()
                self._next.place = 0
                self._number_waiting()
                self.put_back(self._next)

    @property
    def deadline(self) -> float:
        """When the first of those that wait has waited for too long, on the monotonic clock."""
        return min((request.deadline for request in self.waiting), default=math.inf)

    def refuse_expired(self) -> None:
        """Refuse those that have waited for too long."""
        now = threads.monotonic()
        for request in list(self.waiting):
            if now >= request.deadline:
                self._drop_request(
                    request, f'busy: {self.element.procedure or "another"} came first'
                )

    def refuse(self, refusal: Refused) -> None:
        """Refuse all."""
        for request in (*self._open, *self.waiting):
            request.refuse(refusal)
        self.waiting.clear()

    def _must_wait(self, request: Asked) -> bool:
        running, asked = self.element.procedure, request.asked
        has_turn = isinstance(asked, Procedures) and not isinstance(asked, Abort)
        if not (running and request.waits and has_turn):
            return False
        self.element.check_arguments(request.asked)
        if len(self.waiting) >= self.most:
            self.refuse_expired()
        if len(self.waiting) >= self.most > 0:
            raise Refused(
                f'busy: {running} is running, and {self.most} requests wait',
                code=ErrorCode.BUSY,
            )
        return self.most > 0

    def _drop_request(self, request: Asked, why: str) -> None:
        self.waiting.remove(request)
        self._number_waiting()
        waited = 'while it waited for its turn: nothing has changed'
        self._refuse_request(request, Refused(f'{why} {waited}'))

    def _refuse_request(self, request: Asked, refusal: Refused) -> None:
        self.statistics.refused += 1
        request.refuse(refusal)

    def _number_waiting(self) -> None:
        for place, request in enumerate(self.waiting, start=1):
            request.place = place
