# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What other threads leave for a loop: one lock guards all of it, one thread takes it out."""

from __future__ import annotations

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
    """Asks for an end of the procedure that a command began; of that very one, not an equal."""

    of: Command


Asked = tuple[Command | Cancel, 'Future[Outcome | None]']
"""A command and what becomes of it."""

Call = tuple[Callable[[], Any], 'Future[Any]']
"""A function to be called between two ticks, and its result."""


MOST = 1000
"""Commands, or single ticks, that may wait: while time is held nothing takes them out."""


class Ending(Enum):
    """How a loop shall end."""

    NOT = 'goes on'
    FINISH = 'aborts what runs and lets go of the strain first'
    STOP = 'after the present tick'


class Mailbox:
    """Requests that wait for the loop's thread, and how that thread shall run.

    Attributes:
        changed: Notified when anything here has changed; its lock guards all attributes.
        paused: Whether time is held.
        speed: Factor on real time; 0 for as fast as the loop can.
        ending: How the loop shall end.
    """

    def __init__(self, speed: float) -> None:
        self.changed = threads.Condition()
        self.paused = False
        self.speed = speed
        self.ending = Ending.NOT
        self._closed: Refused | None = None
        self._commands: deque[Asked] = deque()
        self._calls: deque[Call] = deque()
        self._single_ticks: deque[Future[int]] = deque()

    # --- from any thread -----------------------------------------------------------------

    def submit(self, command: Command | Cancel) -> Future[Outcome | None]:
        """Leave a command for the next tick.

        An acceleration of the base replaces one that still waits as the last: the base of a
        robot tells it more often than there are ticks, and while time is held.
        """
        answer: Future[Outcome | None] = threads.Future()
        superseded = None
        with self.changed:
            last = self._commands[-1][0] if self._commands else None
            if self._closed is None and isinstance(command, Disturb) and isinstance(last, Disturb):
                _, superseded = self._commands.pop()
            if (refusal := self._closed or _full(self._commands)) is None:
                self._commands.append((command, answer))
                self.changed.notify_all()
        if superseded is not None and superseded.set_running_or_notify_cancel():
            superseded.set_result(None)
        return _refused(answer, refusal)

    def call(self, function: Callable[[], T], paused: bool | None = None) -> Future[T]:
        """Leave a function to be called between two ticks; with `paused`, hold time or let it run.

        Once it is called, no tick is under way that began before.
        """
        answer: Future[T] = threads.Future()
        with self.changed:
            if (refusal := self._closed) is None:
                self.paused = self.paused if paused is None else paused
                self._calls.append((function, answer))
                self.changed.notify_all()
        return _refused(answer, refusal)

    def single_tick(self) -> Future[int]:
        """Ask for one tick while time is held."""
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
        """Run at another factor on real time from the next tick on."""
        with self.changed:
            self.speed = speed
            self.changed.notify_all()

    def end(self, ending: Ending) -> None:
        """Have the loop end; one that shall stop does not finish any more."""
        with self.changed:
            if self.ending is not Ending.STOP:
                self.ending = ending
            self.changed.notify_all()

    def close(self, refusal: Refused) -> None:
        """Refuse all who wait, and all who come from now on; the first reason stays."""
        with self.changed:
            self._closed = refusal = self._closed or refusal
            asked: Sequence[tuple[Any, Future[Any]]] = (*self._commands, *self._calls)
            waiting = [answer for _, answer in asked] + list(self._single_ticks)
            for queue in (self._commands, self._calls, self._single_ticks):
                queue.clear()
        for answer in waiting:
            if answer.set_running_or_notify_cancel():
                answer.set_exception(refusal)

    # --- in the loop's thread ------------------------------------------------------------

    @property
    def command_waits(self) -> bool:
        """Whether a command waits; to be asked with the lock held."""
        return bool(self._commands)

    @property
    def call_waits(self) -> bool:
        """Whether a call waits; to be asked with the lock held."""
        return bool(self._calls)

    @property
    def held(self) -> bool:
        """Whether no tick shall run; to be asked with the lock held."""
        return self.paused and not self._single_ticks and self.ending is Ending.NOT

    @property
    def single_tick_waits(self) -> bool:
        """Whether a single tick is asked for; to be asked with the lock held."""
        return bool(self._single_ticks)

    def take_single_tick(self) -> Future[int] | None:
        """Take out who waits longest for a single tick and has not withdrawn."""
        with self.changed:
            while self._single_ticks:
                taken = self._single_ticks.popleft()
                if taken.set_running_or_notify_cancel():
                    return taken
        return None

    def take_call(self) -> Call | None:
        """Take out the oldest call that was not withdrawn, which cannot be from now on."""
        return self._take(self._calls)

    def take_command(self) -> Asked | None:
        """Take out the oldest command that was not withdrawn, which cannot be from now on."""
        return self._take(self._commands)

    def _take(self, queue: deque[tuple[T, Future[Any]]]) -> tuple[T, Future[Any]] | None:
        while True:
            with self.changed:
                if not queue:
                    return None
                taken = queue.popleft()
            if taken[1].set_running_or_notify_cancel():
                return taken


def _full(queue: Sized) -> Refused | None:
    return Refused(f'{MOST} requests wait already') if len(queue) >= MOST else None


def _refused(answer: Future[T], refusal: Refused | None) -> Future[T]:
    if refusal is not None:
        answer.set_exception(refusal)
    return answer
