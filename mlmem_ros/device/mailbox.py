# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Requests from other threads to a loop: one lock guards them, one thread takes them out."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sized
from concurrent.futures import Future
from dataclasses import dataclass
from enum import Enum
from typing import Any, TypeVar

from .. import threads
from .commands import Command, Disturb
from .errors import Refused
from .events import Outcome

T = TypeVar('T')
R = TypeVar('R', bound=tuple[Any, ...])


@dataclass(frozen=True)
class Cancel:
    """A request to end the procedure of exactly this command, not of an equal one."""

    of: Command


Asked = tuple[Command | Cancel, 'Future[Outcome | None]']
"""A command and its result."""

Shake = tuple[float, Disturb, 'Future[Outcome | None]']
"""Time of a base acceleration, its value, and its result."""

Call = tuple[Callable[[], Any], 'Future[Any]']
"""A function to be called between two ticks, and its result."""

MOST = 1000
"""Most pending commands, accelerations or single ticks: a pause keeps them waiting."""


class Ending(Enum):
    """How a loop is to end."""

    NOT = 'goes on'
    FINISH = 'aborts any procedure and releases the strain first'
    STOP = 'after the present tick'


class Mailbox:
    """Requests that wait for the loop's thread, and how that thread is to run.

    Attributes:
        changed: Notified when anything here changes; its lock guards all attributes.
        commands: Pending commands with their answers, oldest first.
        shakes: Pending accelerations of the base with their times and answers.
        calls: Pending functions with their answers.
        single_ticks: Answers to requests for a single tick.
        paused: Whether time is paused.
        speed: Multiple of real time; 0 for as fast as possible.
        ending: How the loop is to end.
    """

    def __init__(self, speed: float) -> None:
        self.changed = threads.Condition()
        self.paused = False
        self.speed = speed
        self.ending = Ending.NOT
        self._closed: Refused | None = None
        self.commands: deque[Asked] = deque()
        self.shakes: deque[Shake] = deque()
        self.calls: deque[Call] = deque()
        self.single_ticks: deque[tuple[Future[int]]] = deque()

    # --- from any thread -----------------------------------------------------------------

    def submit(self, command: Command | Cancel) -> Future[Outcome | None]:
        """Leave a command for the next tick."""
        with self.changed:
            return self._left(self.commands, command, refusal=_full(self.commands))

    def shake(self, when: float, command: Disturb) -> Future[Outcome | None]:
        """Leave an acceleration of the base for the tick that a time falls into.

        It does not wake the loop, because such messages are frequent. While time is paused, a
        newer one replaces the last.
        """
        answer: Future[Outcome | None] = threads.Future()
        superseded = None
        with self.changed:
            if (refusal := self._closed) is not None:
                answer.set_exception(refusal)
                return answer
            if self.shakes and (self.held or len(self.shakes) == MOST):
                *_, superseded = self.shakes.pop()
            self.shakes.append((when, command, answer))
        if superseded is not None and superseded.set_running_or_notify_cancel():
            superseded.set_result(None)
        return answer

    def call(self, function: Callable[[], T], paused: bool | None = None) -> Future[T]:
        """Leave a function to be called between two ticks; with `paused`, pause or resume time.

        When it is called, no earlier tick is still running.
        """
        with self.changed:
            if self._closed is None and paused is not None:
                self.paused = paused
            return self._left(self.calls, function)

    def single_tick(self) -> Future[int]:
        """Ask for one tick while time is paused."""
        with self.changed:
            refusal = None if self.paused else Refused('step works only while paused; pause first')
            refusal = _full(self.single_ticks) or refusal
            return self._left(self.single_ticks, refusal=refusal)

    def set_speed(self, speed: float) -> None:
        """Run at another multiple of real time from the next tick on."""
        with self.changed:
            self.speed = speed
            self.changed.notify_all()

    def end(self, ending: Ending) -> None:
        """End the loop; one that is to stop no longer finishes."""
        with self.changed:
            if self.ending is not Ending.STOP:
                self.ending = ending
            self.changed.notify_all()

    def close(self, refusal: Refused) -> None:
        """Refuse all pending and future requests; the first reason stays."""
        queues: tuple[deque[Any], ...]
        queues = (self.commands, self.shakes, self.calls, self.single_ticks)
        with self.changed:
            self._closed = refusal = self._closed or refusal
            waiting = [answer for queue in queues for *_, answer in queue]
            for queue in queues:
                queue.clear()
        for answer in waiting:
            if answer.set_running_or_notify_cancel():
                answer.set_exception(refusal)

    def _left(
        self, queue: deque[Any], *request: object, refusal: Refused | None = None
    ) -> Future[Any]:
        """Leave a request with its answer, or refuse it; call with the lock held."""
        answer: Future[Any] = threads.Future()
        if (refusal := self._closed or refusal) is not None:
            answer.set_exception(refusal)
        else:
            queue.append((*request, answer))
            self.changed.notify_all()
        return answer

    # --- in the loop's thread ------------------------------------------------------------

    @property
    def held(self) -> bool:
        """Whether ticks are held back; call with the lock held."""
        return self.paused and not self.single_ticks and self.ending is Ending.NOT

    def take(self, queue: deque[R]) -> R | None:
        """Take out the oldest request whose answer was not cancelled; it no longer can be."""
        while True:
            with self.changed:
                if not queue:
                    return None
                taken = queue.popleft()
            if taken[-1].set_running_or_notify_cancel():
                return taken

    def take_shake(self, before: float) -> Asked | None:
        """Take out the newest acceleration from before a time; it supersedes older ones."""
        taken: list[Shake] = []
        with self.changed:
            while self.shakes and self.shakes[0][0] < before:
                taken.append(self.shakes.popleft())
        live = [each[1:] for each in taken if each[2].set_running_or_notify_cancel()]
        for _, superseded in live[:-1]:
            superseded.set_result(None)
        return live[-1] if live else None

    def next_shake(self) -> float:
        """Return the time of the oldest pending acceleration; infinity if there is none."""
        with self.changed:
            return self.shakes[0][0] if self.shakes else math.inf


def _full(queue: Sized) -> Refused | None:
    return Refused(f'{MOST} requests are already waiting') if len(queue) >= MOST else None
