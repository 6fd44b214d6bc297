# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Real time: a thread that runs a device's ticks at the pace of a clock.

The clock decides only when the next tick runs, never what it computes. A tick that comes late
is counted, and the time that was lost is skipped, not caught up.

To wake up costs more than a tick. While nothing is under way, ticks are therefore put off and run
several at a time, one period before the tick that they are put off to and published by, which
then comes in time. A command ends such a rest: it takes effect in the tick that it falls into.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from typing import Any, TypeVar

from .commands import Abort, Command, Disturb, Procedures
from .element import MemoryElement
from .errors import Refused
from .events import Event, Outcome
from .loop_statistics import LoopStatistics
from .pacing import Pacer, SteadyPacer

T = TypeVar('T')

Stamped = tuple[int, Command]
"""A command and the tick at which it took effect."""

Listener = Callable[[Sequence[Stamped], Sequence[Event]], None]
"""Called in the loop's thread after every tick, or run of ticks of a resting device."""

LONGEST_SLEEP = 0.1
"""Seconds after which a sleeping loop looks again whether the clock has jumped."""

LONGEST_REST = 0.04
"""Seconds for which the ticks of a resting device are put off at most."""


class Loop:
    """Runs a device and hands it commands at tick boundaries.

    Attributes:
        element: The device; only the loop's thread changes it.
        statistics: How the loop keeps time.
        speed: Factor on real time that is asked for; 0 for as fast as it can.
        failure: What stopped the loop, or None.
    """

    def __init__(
        self,
        element: MemoryElement,
        listener: Listener,
        *,
        pacer: Pacer | None = None,
        speed: float = 1.0,
        rest_ticks: int = 1,
        heard_ticks: int = 1,
    ) -> None:
        """Prepare a loop; `start` sets it going.

        Args:
            element: The device.
            listener: Called after ticks with the commands that they began with and their events.
            pacer: The clock; by default the steady clock of the machine.
            speed: Factor on the scale's real time; 0 runs as fast as it can.
            rest_ticks: Ticks that a resting device may run at a time: whoever listens is served
                in time where every tick that matters to it is a multiple of this number.
            heard_ticks: No run of ticks goes on beyond a multiple of this number.
        """
        self.element = element
        self.statistics = LoopStatistics()
        self.failure: Exception | None = None
        self._listener = listener
        self._pacer = pacer or SteadyPacer()
        self._rest_ticks = rest_ticks
        self._heard_ticks = heard_ticks
        self.set_speed(speed)
        self._calls: deque[tuple[Callable[[], Any], Future[Any]]] = deque()
        self._inbox: deque[tuple[Command, Future[Outcome | None]]] = deque()
        self._answers: deque[Future[Outcome | None]] = deque()
        self._paused = False
        self._single_ticks: deque[Future[int]] = deque()
        self._finishing = False
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

    def finish(self) -> None:
        """Abort what runs, bring the strain to zero without waiting for the clock, and stop."""
        with self._changed:
            self._finishing = True
            waiting = self._waiting()
        _refuse(waiting, Refused('the device is shut down'))
        if self._thread.is_alive():
            self.pause(False)
            moved = self.call(lambda: not self.element.idle)
            if moved.exception() is None and moved.result():
                self.submit(Abort('the device is shut down')).exception()  # waits for its end
        self.stop()

    def set_speed(self, speed: float) -> None:
        """Run at a factor of the scale's real time; 0 runs as fast as it can."""
        self.speed = speed
        self._period = self.tick_seconds / speed if speed > 0.0 else 0.0
        longest = LONGEST_REST + 1e-9  # a rest of that length is not lost by rounding
        self._together = max(
            ticks
            for ticks in range(1, self._rest_ticks + 1)
            if ticks == 1 or (self._rest_ticks % ticks == 0 and ticks * self._period <= longest)
        )

    @property
    def tick_seconds(self) -> float:
        """Real time that a tick stands for: times the ticks in a second, the factor."""
        return self.element.tick * self.element.settings.scale.time

    def call(self, function: Callable[[], T]) -> Future[T]:
        """Have a function called between two ticks, in the loop's thread, paused or not."""
        answer: Future[T] = Future()
        with self._changed:
            stopped = self._stopped()
            if not stopped:
                self._calls.append((function, answer))
                self._changed.notify_all()
        if stopped:
            answer.set_exception(stopped)
        return answer

    def submit(self, command: Command) -> Future[Outcome | None]:
        """Hand in a command for the next tick.

        Returns:
            What becomes of it: the outcome of a procedure when it ends, None for a set-point
            once it is taken, the exception `Refused` where it is not.
        """
        answer: Future[Outcome | None] = Future()
        superseded: Future[Outcome | None] | None = None
        with self._changed:
            refusal = self._stopped() or self._impossible(command)
            if not refusal:
                if isinstance(command, Disturb) and self._inbox:
                    superseded = self._supersede()
                self._inbox.append((command, answer))
                self._changed.notify_all()
        if superseded and superseded.set_running_or_notify_cancel():
            superseded.set_result(None)
        if refusal:
            answer.set_exception(refusal)
        return answer

    def _impossible(self, command: Command) -> Refused | None:
        """Return the refusal of an acceleration that must not take the place of another."""
        if isinstance(command, Disturb):
            try:
                self.element.base.check(command.acceleration)
            except Refused as refusal:
                return refusal
        return None

    def _supersede(self) -> Future[Outcome | None] | None:
        """Take back a last command in the inbox which a new acceleration of the base replaces.

        The base of a robot tells it more often than there are ticks, and while time is held.
        """
        last, answer = self._inbox[-1]
        if not isinstance(last, Disturb):
            return None
        self._inbox.pop()
        return answer

    @property
    def paused(self) -> bool:
        """Whether time is held."""
        return self._paused

    def pause(self, paused: bool) -> Future[int]:
        """Hold time, or let it run on.

        Returns:
            The number of ticks done: when held, after the last that was still under way.
        """
        with self._changed:
            self._paused = paused
            self._changed.notify_all()
        return self.call(lambda: self.element.ticks)

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
        try:
            self._run_ticks()
        except Exception as failure:  # anything: a device that failed must say so, and stop
            with self._changed:
                self.failure = failure
            self._refuse_all()

    def _run_ticks(self) -> None:
        due = self._pacer.now()
        while (begin := self._wait(due)) is not None:
            due, put_off = begin
            due += put_off * self._period
            if put_off:
                self._rest(due, put_off)
            else:
                due = self._after(due, self._tick(due, self._take_commands()))

    def _rest(self, due: float, ticks: int) -> None:
        """Run ticks that were put off, in one go up to each that the listener waits for."""
        while ticks:
            run = min(ticks, self._heard_ticks - self.element.ticks % self._heard_ticks)
            begun = self._pacer.now()
            self.element.rest(run)
            self._listener([], [])
            busy = (self._pacer.now() - begun) / run
            for number in range(run):
                self.statistics.count(max(0.0, begun + number * busy - due), busy)
            ticks -= run

    def _tick(self, due: float, commands: list[Stamped]) -> float:
        """Run one tick with the commands that take effect in it; return when it ended."""
        begun = self._pacer.now()
        single = bool(self._single_ticks)  # asked for before this tick began
        events = self.element.advance()
        self._answer(events)
        self._listener(commands, events)
        if single and (done := self._single_ticks.popleft()).set_running_or_notify_cancel():
            done.set_result(self.element.ticks)
        now = self._pacer.now()
        self.statistics.count(max(0.0, begun - due), now - begun)
        return now

    def _after(self, due: float, now: float) -> float:
        """Return when the next tick is due; time that was lost is counted and skipped."""
        if self._period == 0.0:
            return now
        lag = now - (due + self._period)
        rested = LONGEST_REST if self._together > 1 and self.element.resting else 0.0
        borne = max(self._period, self._pacer.slack, rested)  # who rests may come late, too
        skipped = int(lag / self._period) if lag > borne else 0
        self.statistics.overruns += skipped
        return due + (1 + skipped) * self._period

    def _wait(self, due: float) -> tuple[float, int] | None:
        """Wait until ticks shall run.

        Returns:
            When the first of them was due, and how many shall run that were put off; 0 for a
            single one that takes the commands. None when the loop shall end.
        """
        while True:
            self._make_calls()
            with self._changed:
                if self._stopping:
                    return None
                if self._paused and not self._single_ticks:
                    self._changed.wait_for(
                        lambda: (
                            self._stopping
                            or not self._paused
                            or bool(self._single_ticks)
                            or bool(self._calls)
                        )
                    )
                    due = self._pacer.now()
                    continue
                unpaced = self._paused or self._finishing  # paused: a single tick is asked for
                now = self._pacer.now()
                if unpaced:
                    return min(due, now), 0
                due = min(due, now + self._period)  # a clock that jumped back is not waited for
                put_off = self._put_off(now - due)
                wake = due + max(0, put_off - 1) * self._period
                if now >= wake:
                    return due, put_off
                if not self._calls:
                    self._pacer.wait(self._changed, min(wake - now, LONGEST_SLEEP))

    def _put_off(self, late: float) -> int:
        """Return how many ticks to put off, when the next is late by a time (if positive)."""
        if self._together == 1 or not self.element.resting:
            return 0
        ticks = -(self.element.ticks + 1) % self._together
        return min(ticks, max(0, int(late / self._period))) if self._inbox else ticks

    def _make_calls(self) -> None:
        while self._calls:
            function, answer = self._calls.popleft()
            if answer.set_running_or_notify_cancel():
                try:
                    answer.set_result(function())
                except Exception as failure:  # it is the caller's
                    answer.set_exception(failure)

    def _take_commands(self) -> list[Stamped]:
        taken = []
        while waiting := self._next():
            command, answer = waiting
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
            if isinstance(command, Procedures):
                self._answers.append(answer)
            else:
                answer.set_result(None)
        return taken

    def _next(self) -> tuple[Command, Future[Outcome | None]] | None:
        with self._changed:
            return self._inbox.popleft() if self._inbox else None

    def _answer(self, events: Sequence[Event]) -> None:
        for event in events:
            if isinstance(event, Outcome):
                self._answers.popleft().set_result(event)

    def _refuse_all(self) -> None:
        """Refuse who still waits; nobody joins them any more."""
        with self._changed:
            refusal = self._stopped()
            waiting = self._waiting()
            running = list(self._answers)
            self._answers.clear()
        _refuse(waiting, refusal)
        for answer in running:
            answer.set_exception(refusal)

    def _waiting(self) -> list[Future[Any]]:
        """Take out what has been asked for and not begun."""
        waiting: list[Future[Any]] = [answer for _, answer in (*self._inbox, *self._calls)]
        waiting += self._single_ticks
        for queue in (self._inbox, self._calls, self._single_ticks):
            queue.clear()
        return waiting


def _refuse(waiting: Sequence[Future[Any]], refusal: Refused | None) -> None:
    for answer in waiting:
        if answer.set_running_or_notify_cancel():
            answer.set_exception(refusal)
