# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Requests to a running device: one object from the edge to the answer.

Other threads leave them in the `Mailbox` for the loop's: one lock guards it, one thread takes them
out. `OpenRequests` are those whose commands the element carries out.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sized
from concurrent.futures import Future
from dataclasses import dataclass, field
from numbers import Integral
from typing import Any, Generic, TypeVar

from .. import threads
from ..commands import Command, Disturb, Outcome
from ..element import MemoryElement, ProcedureRun
from ..errors import ErrorCode, Refused
from ..procedure_table import Abort, Procedures

T = TypeVar('T')


@dataclass(eq=False)
class Request(Generic[T]):
    """What is asked of a device, who waits for it, and what came of it.

    Any thread may make one. The loop's thread takes it up and settles it, at once or when its
    procedure has ended.

    Attributes:
        asked: A command, a `Cancel`, or a function to call between two ticks.
        answer: Its outcome, for whoever waits: the exception `Refused` if it is not accepted.
        waits: Whether it waits for its turn while a procedure runs; if not, it is refused.
        deadline: When its turn must have come, on the steady clock.
        place: Its place among those that wait, from 1; 0 if it does not wait.
        run: The procedure that it has begun, or None.
    """

    asked: Any
    answer: Future[T] = field(default_factory=lambda: threads.Future())
    waits: bool = False
    deadline: float = math.inf
    place: int = 0
    run: ProcedureRun | None = None

    @property
    def outcome(self) -> Outcome | None:
        """How its procedure has ended; None without one, and while it runs."""
        return self.run.outcome if self.run is not None else None

    def take_up(self) -> bool:
        """Return whether somebody still waits, who can no longer withdraw it then."""
        return self.answer.running() or self.answer.set_running_or_notify_cancel()

    def resolve(self, outcome: T) -> None:
        """Answer it."""
        self.answer.set_result(outcome)

    def refuse(self, reason: BaseException) -> Request[T]:
        """Answer it with an exception; return it. It waits no longer."""
        self.place = 0
        self.answer.set_exception(reason)
        return self


@dataclass(frozen=True)
class Cancel:
    """What ends the procedure of exactly this request, and no other."""

    of: Request[Any]


Asked = Request[Outcome | None]
"""A request with a command, or a `Cancel`."""

Stamped = tuple[int, Command]
"""A command and the tick at which it took effect."""

Resolve = Callable[[Asked], None]
"""Called in the loop's thread, between two ticks, when a request's procedure has ended."""


MAX_PENDING_REQUESTS = 1000
"""Most pending commands, accelerations or single ticks: a pause keeps them waiting."""


@dataclass
class TickRequest:
    """Ticks that are asked for while time is paused.

    Attributes:
        left: How many remain; less than were asked for once time was paused or resumed.
        done: How many were run.
    """

    left: int
    done: int = 0


class Mailbox:
    """Requests that wait for the loop's thread, and how that thread is to run.

    Attributes:
        changed: Notified when anything here changes; its lock guards all attributes.
        commands: Pending commands, oldest first.
        shakes: Pending accelerations of the base, which are accepted, with their times.
        steps: Pending requests for ticks while time is paused.
        speed: Multiple of real time; 0 for as fast as possible.
        ending: Whether the loop is to end.
        asleep: Whether the loop waits so long that even an acceleration has to wake it.
    """

    def __init__(self, speed: float) -> None:
        self.changed = threads.Condition()
        self.paused = False
        self.speed = speed
        self.ending = False
        self.asleep = False
        self._closed: Refused | None = None
        self.commands: deque[Asked] = deque()
        self.shakes: deque[tuple[float, Disturb]] = deque()
        self.calls: deque[Request[Any]] = deque()
        self.steps: deque[Request[int]] = deque()

    # --- from any thread -----------------------------------------------------------------

    def submit(self, request: Asked) -> Asked:
        """Leave a command for the next tick."""
        with self.changed:
            return self._post_request(self.commands, request, _refuse_if_full(self.commands))

    def post_acceleration(self, when: float, command: Disturb) -> Asked:
        """Leave an acceleration of the base for the tick that a time falls into: it is accepted.

        It does not wake the loop, unless `asleep`, because such messages are frequent. While time
        is paused, a newer one replaces the last.
        """
        request: Asked = Request(command)
        with self.changed:
            if self._closed is not None:
                return request.refuse(self._closed)
            if self.shakes and (self.is_held or len(self.shakes) == MAX_PENDING_REQUESTS):
                self.shakes.pop()
            self.shakes.append((when, command))
            if self.asleep:
                self.changed.notify_all()
        request.resolve(None)
        return request

    def call(self, function: Callable[[], T], paused: bool | None = None) -> Future[T]:
        """Leave a function to be called between two ticks; with `paused`, pause or resume time,
        either of which ends the ticks that are asked for.

        When it is called, no earlier tick is still running.
        """
        with self.changed:
            if self._closed is None and paused is not None:
                self.paused = paused
                for steps in (request.asked for request in self.steps):
                    steps.left = min(steps.left, 1)
            return self._post_request(self.calls, Request[T](function)).answer

    def step(self, ticks: int) -> Request[int]:
        """Ask for ticks while time is paused."""
        with self.changed:
            refusal = _refuse_if_full(self.steps)
            if not self.paused:
                why = 'step works only while paused; pause first'
                refusal = Refused(ErrorCode.CONFLICT, reason=why)
            if not (isinstance(ticks, Integral) and ticks >= 1):
                refusal = Refused.out_of_range('ticks', ticks, 'a whole number of at least 1')
            return self._post_request(self.steps, Request[int](TickRequest(ticks)), refusal)

    def set_speed(self, speed: float) -> None:
        """Run at another multiple of real time from the next tick on."""
        with self.changed:
            self.speed = speed
            self.changed.notify_all()

    def end(self) -> None:
        """End the loop after the present tick."""
        with self.changed:
            self.ending = True
            self.changed.notify_all()

    def close(self, refusal: Refused) -> None:
        """Refuse all pending and future requests; the first reason stays."""
        with self.changed:
            self._closed = refusal = self._closed or refusal
            self.shakes.clear()
            waiting: list[Request[Any]] = []
            for queue in (self.commands, self.calls, self.steps):
                waiting += queue
                queue.clear()
        for request in waiting:
            if request.take_up():
                request.refuse(refusal)

    def _post_request(
        self, queue: deque[Request[T]], request: Request[T], refusal: Refused | None = None
    ) -> Request[T]:
        """Leave a request, or refuse it; call with the lock held."""
        if (refusal := self._closed or refusal) is not None:
            return request.refuse(refusal)
        queue.append(request)
        self.changed.notify_all()
        return request

    # --- in the loop's thread ------------------------------------------------------------

    def put_back(self, request: Asked) -> None:
        """Leave a command that was taken out, before all others."""
        with self.changed:
            if self._closed is not None:
                request.refuse(self._closed)
            else:
                self.commands.appendleft(request)

    @property
    def is_held(self) -> bool:
        """Whether ticks are held back; call with the lock held."""
        return self.paused and not self.steps and not self.ending

    def take_request(self, queue: deque[Request[T]]) -> Request[T] | None:
        """Take out the oldest request that was not withdrawn; it no longer can be."""
        while True:
            with self.changed:
                if not queue:
                    return None
                request = queue.popleft()
            if request.take_up():
                return request

    def count_step(self, ticks: int) -> None:
        """Count a tick that was asked for; answer its request, with all ticks so far, if it was
        the last.
        """
        with self.changed:  # or a pause in between would miss the request
            if (request := self.take_request(self.steps)) is None:
                return
            steps: TickRequest = request.asked
            steps.done, steps.left = steps.done + 1, steps.left - 1
            closed = self._closed if steps.left else None
            if steps.left and closed is None:
                self.steps.appendleft(request)
        if closed is not None:
            request.refuse(closed)
        elif not steps.left:
            request.resolve(ticks)

    def take_shakes(
        self, due: float = math.inf, period: float = 1.0, ticks: int = 1
    ) -> dict[int, Disturb]:
        """Take out the accelerations that fall into some ticks, or come before them.

        Args:
            due: When the first of these ticks is due; by default, all are taken.
            period: Between two of them.
            ticks: How many they are.

        Returns:
            By number of the tick, from 0, its newest; it supersedes older ones.
        """
        taken: dict[int, Disturb] = {}
        with self.changed:
            while self.shakes and self.shakes[0][0] < due + ticks * period:
                when, command = self.shakes.popleft()
                taken[int(min(max((when - due) / period, 0.0), ticks - 1.0))] = command
        return taken

    def find_next_shake(self) -> float:
        """Return the time of the oldest pending acceleration; infinity if there is none."""
        with self.changed:
            return self.shakes[0][0] if self.shakes else math.inf


def _refuse_if_full(queue: Sized) -> Refused | None:
    if len(queue) < MAX_PENDING_REQUESTS:
        return None
    why = f'busy: {MAX_PENDING_REQUESTS} requests are already waiting'
    return Refused(ErrorCode.BUSY, reason=why)


@dataclass
class OpenRequests:
    """Applies commands to an element, and remembers the requests whose procedures run.

    One procedure runs at a time. The others wait for their turn, in order of arrival; all else
    passes them.

    Attributes:
        element: What carries out the commands.
        answer: Answers a request whose procedure has ended.
        put_back: Takes the request whose turn has come.
        most: How many may wait.
        waiting: Those that wait, in order of arrival.
    """

    element: MemoryElement
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
            request.refuse(refusal)
            return []
        except BaseException as failure:  # whatever it is, its client must hear of it
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
                first = self.element.procedure or 'another'
                self._drop_request(request, f'busy: {first} came first', ErrorCode.BUSY)

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
            why = f'busy: {running} is running, and {self.most} requests wait'
            raise Refused(ErrorCode.BUSY, reason=why)
        return self.most > 0

    def _drop_request(self, request: Asked, why: str, code: ErrorCode = ErrorCode.OTHER) -> None:
        self.waiting.remove(request)
        self._number_waiting()
        why += ' while it waited for its turn: nothing has changed'
        request.refuse(Refused(code, reason=why))

    def _number_waiting(self) -> None:
        for place, request in enumerate(self.waiting, start=1):
            request.place = place
