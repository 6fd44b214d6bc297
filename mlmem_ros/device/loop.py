# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Real time: a thread that runs a device's ticks on a steady clock.

The clock decides only when the next tick runs, never what it computes. A tick that comes late
is counted, and the wall time that was lost is skipped, not caught up.
"""

from __future__ import annotations

import math
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Any

from .commands import Abort, Calibrate, Command, Erase, Read, Write
from .element import MemoryElement
from .errors import Refused
from .events import Event, Outcome

Stamped = tuple[int, Command]
"""A command and the tick at which it took effect."""

Listener = Callable[[Sequence[Stamped], Sequence[Event]], None]
"""Called in the loop's thread after every tick."""

LATENESS_MEMORY = 0.002
"""Weight of the newest tick in the running mean and variance of the lateness."""


@dataclass
class LoopStatistics:
    """How the loop keeps time; all times in seconds.

    Attributes:
        ticks: Ticks run.
        overruns: Ticks of wall time that were skipped.
        refused: Commands that were refused.
        lateness_mean: Running mean of how late ticks began.
        lateness_variance: Running variance of the same.
        busy: Running mean of the time a tick takes.
    """

    ticks: int = 0
    overruns: int = 0
    refused: int = 0
    lateness_mean: float = 0.0
    lateness_variance: float = 0.0
    busy: float = 0.0

    def count(self, lateness: float, busy: float) -> None:
        """Take the times of one tick."""
        self.ticks += 1
        weight = max(LATENESS_MEMORY, 1.0 / self.ticks)
        deviation = lateness - self.lateness_mean
        self.lateness_mean += weight * deviation
        self.lateness_variance += weight * (deviation * deviation - self.lateness_variance)
        self.busy += weight * (busy - self.busy)

    @property
    def lateness_deviation(self) -> float:
        """Standard deviation of the lateness."""
        return math.sqrt(self.lateness_variance)


class Loop:
    """Runs a device and hands it commands at tick boundaries.

    Attributes:
        element: The device; only the loop's thread changes it.
        statistics: How the loop keeps time.
        failure: What stopped the loop, or None.
    """

    def __init__(self, element: MemoryElement, listener: Listener) -> None:
        """Prepare a loop; `start` sets it going.

        Args:
            element: The device.
            listener: Called after every tick with the commands it began with and its events.
        """
        self.element = element
        self.statistics = LoopStatistics()
        self.failure: Exception | None = None
        self._listener = listener
        self._period = element.tick * element.settings.scale.time
        self._inbox: deque[tuple[Command, Future[Outcome | None]]] = deque()
        self._answers: deque[Future[Outcome | None]] = deque()
        self._paused = False
        self._single_ticks: deque[Future[int]] = deque()
        self._stopping = False
        self._changed = threading.Condition()
        self._thread = threading.Thread(target=self._run, name='mlmem-loop', daemon=True)

    # --- from any thread -----------------------------------------------------------------

    def start(self) -> None:
        """Let time run."""
        self._thread.start()

    def stop(self) -> None:
        """End the loop after the present tick; who still waits is refused."""
        with self._changed:
            self._stopping = True
            self._changed.notify_all()
        if self._thread.is_alive():
            self._thread.join()
        self._refuse_all()

    def submit(self, command: Command) -> Future[Outcome | None]:
        """Hand in a command for the next tick.

        Returns:
            What becomes of it: the outcome of a procedure when it ends, None for a set-point
            once it is taken, the exception `Refused` where it is not.
        """
        answer: Future[Outcome | None] = Future()
        with self._changed:
            stopped = self._stopped()
            if not stopped:
                self._inbox.append((command, answer))
        if stopped:
            answer.set_exception(stopped)
        return answer

    @property
    def paused(self) -> bool:
        """Whether time is held."""
        return self._paused

    def pause(self, paused: bool) -> None:
        """Hold time, or let it run on."""
        with self._changed:
            self._paused = paused
            self._changed.notify_all()

    def single_tick(self) -> Future[int]:
        """Run one tick while paused.

        Returns:
            The number of ticks done, once it is.

        Raises:
            Refused: Time is running, or the loop has ended.
        """
        done: Future[int] = Future()
        with self._changed:
            if stopped := self._stopped():
                raise stopped
            if not self._paused:
                raise Refused('step works only while paused; pause first')
            self._single_ticks.append(done)
            self._changed.notify_all()
        return done

    def _stopped(self) -> Refused | None:
        """Return the refusal of all that comes after the end of the loop."""
        if self.failure:
            return Refused(f'the device has stopped: {self.failure}')
        return Refused('the device is shut down') if self._stopping else None

    # --- in the loop's thread ------------------------------------------------------------

    def _run(self) -> None:
        next_due = time.monotonic()
        while (due := self._wait(next_due)) is not None:
            begun = time.monotonic()
            single = bool(self._single_ticks)  # asked for before this tick began
            try:
                commands = self._take_commands()
                events = self.element.advance()
                self._answer(events)
                self._listener(commands, events)
            except Exception as failure:  # anything: a device that failed must say so, and stop
                with self._changed:
                    self.failure = failure
                self._refuse_all()
                return
            if single and (done := self._single_ticks.popleft()).set_running_or_notify_cancel():
                done.set_result(self.element.ticks)
            now = time.monotonic()
            self.statistics.count(max(0.0, begun - due), now - begun)
            next_due = due + self._period
            if now > next_due + self._period:
                skipped = int((now - next_due) / self._period)
                self.statistics.overruns += skipped
                next_due += skipped * self._period

    def _wait(self, due: float) -> float | None:
        """Wait for the next tick; return when it was due, or None when the loop shall end."""
        with self._changed:
            if not self._paused and (delay := due - time.monotonic()) > 0.0:
                self._changed.wait_for(lambda: self._stopping or self._paused, delay)
            if self._paused:
                self._changed.wait_for(
                    lambda: self._stopping or not self._paused or bool(self._single_ticks)
                )
                due = time.monotonic()
            return None if self._stopping else due

    def _take_commands(self) -> list[Stamped]:
        taken = []
        while self._inbox:
            command, answer = self._inbox.popleft()
            if not answer.set_running_or_notify_cancel():
                continue  # who asked has given up before it was taken
            try:
                self.element.apply(command)
            except Refused as refusal:
                self.statistics.refused += 1
                answer.set_exception(refusal)
                continue
            except Exception as failure:
                answer.set_exception(failure)
                raise
            taken.append((self.element.ticks, command))
            if isinstance(command, Write | Read | Erase | Calibrate | Abort):
                self._answers.append(answer)
            else:
                answer.set_result(None)
        return taken

    def _answer(self, events: Sequence[Event]) -> None:
        for event in events:
            if isinstance(event, Outcome):
                self._answers.popleft().set_result(event)

    def _refuse_all(self) -> None:
        """Refuse who still waits; nobody can join any more."""
        refusal = self._stopped() or Refused('the device has stopped')
        while self._answers:
            self._answers.popleft().set_exception(refusal)
        waiting: list[Future[Any]] = [answer for _, answer in self._inbox]
        waiting += self._single_ticks
        self._inbox.clear()
        self._single_ticks.clear()
        for answer in waiting:
            if answer.set_running_or_notify_cancel():
                answer.set_exception(refusal)
