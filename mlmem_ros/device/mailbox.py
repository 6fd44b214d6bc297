# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Requests of other threads to a loop: one lock guards them all, one thread takes them out."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence, Sized
from concurrent.futures import Future
from dataclasses import dataclass
from enum import Enum
from typing import Any, TypeVar

from .. import threads
from .commands import Command, Disturb
from .errors import Refused
from .events import Outcome

T = TypeVar('T')


@dataclass(frozen=True)
class Cancel:
    """Asks to end the procedure of a command: of this one, not of an equal one."""

    of: Command


Asked = tuple[Command | Cancel, 'Future[Outcome | None]']
"""A command and its result."""

Shake = tuple[float, Disturb, 'Future[Outcome | None]']
"""Time of a base acceleration, its value, and its result."""

Call = tuple[Callable[[], Any], 'Future[Any]']
"""A function to be called between two ticks, and its result."""


MOST = 1000
"""Most commands, or single ticks, that may wait: while time is paused nothing takes them out."""


class Ending(Enum):
    """How a loop is to end."""

    NOT = 'goes on'
    FINISH = 'aborts what runs and lets go of the strain first'
    STOP = 'after the present tick'


class Mailbox:
    """Requests that wait for the loop's thread, and how that thread is to run.

    Attributes:
        changed: Notified when anything here has changed; its lock guards all attributes.
        paused: Whether time is paused.
        speed: Multiple of real time; 0 for as fast as possible.
            ending: How the loop shall end.
    """

    def __init__(self, speed: float) -> None:
        self.changed = threads.Condition()
        self.paused = False
        self.speed = speed
        self.ending = Ending.NOT
        self._closed: Refused | None = None
        self._commands: deque[Asked] = deque()
        self._shakes: deque[Shake] = deque()
        self._calls: deque[Call] = deque()
        self._single_ticks: deque[Future[int]] = deque()

    # --- from any thread -----------------------------------------------------------------

    def submit(self, command: Command | Cancel) -> Future[Outcome | None]:
        """Leave a command for the next tick."""
        answer: Future[Outcome | None] = threads.Future()
        with self.changed:
            if (refusal := self._closed or _full(self._commands)) is None:
                self._commands.append((command, answer))
                self.changed.notify_all()
        return _refused(answer, refusal)

    def shake(self, when: float, command: Disturb) -> Future[Outcome | None]:
        """Leave an acceleration of the base for the tick that a time falls into.

        It does not wake the loop, because such messages are frequent; while time is paused, a
        newer one replaces the last.
        """
        answer: Future[Outcome | None] = threads.Future()
        superseded = None
        with self.changed:
            if (refusal := self._closed) is None:
                if self._shakes and (self.held or len(self._shakes) == MOST):
                    *_, superseded = self._shakes.pop()
                self._shakes.append((when, command, answer))
        if superseded is not None and superseded.set_running_or_notify_cancel():
            superseded.set_result(None)
        return _refused(answer, refusal)

    def call(self, function: Callable[[], T], paused: bool | None = None) -> Future[T]:
        """Leave a function to be called between two ticks; with `paused`, pause or resume time.

        When it is called, no earlier tick is still under way.
        """
        answer: Future[T] = threads.Future()
        with self.changed:
            if (refusal := self._closed) is None:
                self.paused = self.paused if paused is None else paused
                self._calls.append((function, answer))
                self.changed.notify_all()
        return _refused(answer, refusal)

    def single_tick(self) -> Future[int]:
        """Ask for one tick while time is paused."""
        answer: Future[int] = threads.Future()
        with self.changed:
            refusal = self._closed or _full(self._single_ticks)
            if refusal is None and not self.paused:
                refusal = Refused('step works only while paused; pause first')
            if refusal is None:
                self._single_ticks.append(answer)
                self.changed.notify_all()
        return _refused(answer, refusal)

    def set_speed(self, speed: float) -> None:
        """Run at another multiple of real time from the next tick on."""
        with self.changed:
            self.speed = speed
            self.changed.notify_all()

    def end(self, ending: Ending) -> None:
        """End the loop; one that is stopping no longer finishes."""
        with self.changed:
            if self.ending is not Ending.STOP:
                self.ending = ending
            self.changed.notify_all()

    def close(self, refusal: Refused) -> None:
        """Refuse all pending and future requests; the first reason stays."""
        with self.changed:
            self._closed = refusal = self._closed or refusal
            asked: Sequence[tuple[Any, ...]] = (*self._commands, *self._shakes, *self._calls)
            waiting = [answer for *_, answer in asked] + list(self._single_ticks)
            for queue in (self._commands, self._shakes, self._calls, self._single_ticks):
                queue.clear()
        for answer in waiting:
            if answer.set_running_or_notify_cancel():
                answer.set_exception(refusal)

    # --- in the loop's thread ------------------------------------------------------------

    @property
    def command_waits(self) -> bool:
        """Whether a command waits; call with the lock held."""
        return bool(self._commands)

    @property
    def call_waits(self) -> bool:
        """Whether a call waits; call with the lock held."""
        return bool(self._calls)

    @property
    def held(self) -> bool:
        """Whether no tick is to run; call with the lock held."""
        return self.paused and not self._single_ticks and self.ending is Ending.NOT

    @property
    def single_tick_waits(self) -> bool:
        """Whether a single tick is requested; call with the lock held."""
        return bool(self._single_ticks)

    def take_single_tick(self) -> Future[int] | None:
        """Take out the oldest request for a single tick that was not cancelled."""
        with self.changed:
            while self._single_ticks:
                taken = self._single_ticks.popleft()
                if taken.set_running_or_notify_cancel():
                    return taken
        return None

    def take_call(self) -> Call | None:
        """Take out the oldest call that was not cancelled; it no longer can be."""
        return self._take(self._calls)

    def take_command(self) -> Asked | None:
        """Take out the oldest command that was not cancelled; it no longer can be."""
        return self._take(self._commands)

    def take_shake(self, before: float) -> Asked | None:
        """Take out the newest acceleration from before a time; older ones had no time to act."""
        taken: list[Shake] = []
        with self.changed:
            while self._shakes and self._shakes[0][0] < before:
                taken.append(self._shakes.popleft())
        live = [each[1:] for each in taken if each[2].set_running_or_notify_cancel()]
        for _, superseded in live[:-1]:
            superseded.set_result(None)
        return live[-1] if live else None

    def next_shake(self) -> float:
        """Return the time of the oldest pending acceleration; infinity if there is none."""
        with self.changed:
            return self._shakes[0][0] if self._shakes else math.inf

    def _take(self, queue: deque[tuple[T, Future[Any]]]) -> tuple[T, Future[Any]] | None:
        while True:
            with self.changed:
                if not queue:
                    return None
                taken = queue.popleft()
            if taken[1].set_running_or_notify_cancel():
                return taken


def _full(queue: Sized) -> Refused | None:
    return Refused(f'{MOST} requests are already waiting') if len(queue) >= MOST else None


def _refused(answer: Future[T], refusal: Refused | None) -> Future[T]:
    if refusal is not None:
        answer.set_exception(refusal)
    return answer
