# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Real time: a thread that runs a device's ticks at the pace of a clock.

The clock decides only when the next tick runs, never what it computes. A late tick is counted, and
the lost time is skipped, not caught up.

Waking up costs more than a tick. So while there is nothing to decide, at rest or within a
procedure, ticks are deferred and run several at a time, one period before the tick that ends the
rest. That tick, which publishes a stream or resumes the procedure, comes on time. A command ends
the rest and takes effect in the tick into which it falls. Messages of a shaking base do not end
the rest; they are deferred with the ticks and still take effect in their own. Without a pace all
ticks run in batches, each up to the next that the listener waits for.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from typing import NamedTuple, TypeVar

from .. import threads
from .commands import Abort, Command, Disturb, Procedures
from .element import MemoryElement
from .errors import Refused
from .events import Event, Outcome
from .loop_statistics import LoopStatistics
from .mailbox import Cancel, Ending, Mailbox
from .pacing import Pacer, SteadyPacer

T = TypeVar('T')

Stamped = tuple[int, Command]
"""A command and the tick at which it took effect."""

Listener = Callable[[Sequence[Stamped], Sequence[Event]], None]
"""Called in the loop's thread after every tick, or run of ticks."""

LONGEST_SLEEP = 0.1
"""Longest sleep in seconds before the loop checks whether the clock has jumped."""

LONGEST_REST = 0.04
"""Longest time to defer ticks, in seconds: a command waits while they are made up for."""

SHUT_DOWN = 'the device is shut down'

CANCELED = 'canceled by its client'


class _Turn(NamedTuple):
    """The loop's next work: a batch of deferred ticks, or one tick that takes the commands."""

    due: float
    batch: int = 0
    asked_for: bool = False


class Loop:
    """Runs a device and hands it commands at tick boundaries.

    Attributes:
        element: The device; only the loop's thread changes it.
        statistics: How the loop keeps time.
        failure: What stopped the loop, or None.
    """

    def __init__(
        self,
        element: MemoryElement,
        listener: Listener,
        *,
        pacer: Pacer | None = None,
        speed: float = 1.0,
        batch: int = 1,
        publish_every: int = 1,
        heard: Callable[[], bool] = lambda: True,
        failed: Callable[[], None] = lambda: None,
    ) -> None:
        """Prepare a loop; `start` sets it going.

        Args:
            element: The device.
            listener: Called after ticks with the commands that they began with and their events.
            pacer: The clock; by default the steady clock of the machine.
            speed: Multiple of the scale's real time; 0 runs as fast as possible.
            batch: Most ticks to defer and run together: ticks that matter to the listener must be
                multiples of this number to be on time.
            publish_every: No run of ticks extends beyond a multiple of this number.
            heard: Returns whether anybody waits for the ticks that are multiples of `batch`; if
                not, they are deferred like the others, and longer.
            failed: Called in the loop's thread after a failure has stopped it.
        """
        self.element = element
        self.statistics = LoopStatistics()
        self.failure: Exception | None = None
        self._listener = listener
        self._pacer = pacer or SteadyPacer()
        self._batch = batch
        self._publish_every = publish_every
        self._heard = heard
        self._failed = failed
        self._box = Mailbox(speed)
        self._answers: deque[Future[Outcome | None]] = deque()  # of running procedures
        self._paused = False  # as last seen by the loop's thread
        self._pace(speed)
        self._thread = threads.Thread(target=self._run, name='mlmem-loop', daemon=True)

    # --- from any thread -----------------------------------------------------------------

    def start(self) -> None:
        """Let time run."""
        self._thread.start()

    def stop(self) -> None:
        """End the loop after the present tick, and refuse pending requests."""
        self._end(Ending.STOP)

    def finish(self) -> None:
        """Abort any procedure, bring the strain to zero regardless of the clock, and stop."""
        self._end(Ending.FINISH)

    def _end(self, ending: Ending) -> None:
        self._box.end(ending)
        if self._thread.is_alive():
            self._thread.join()
        self._box.close(Refused(SHUT_DOWN))  # if it was never started

    @property
    def speed(self) -> float:
        """Requested multiple of the scale's real time; 0 for as fast as possible."""
        return self._box.speed

    def set_speed(self, speed: float) -> None:
        """Run at a multiple of the scale's real time from now on; 0: as fast as possible."""
        self._box.set_speed(speed)

    @property
    def tick_seconds(self) -> float:
        """Real time of a tick at speed 1, in seconds."""
        return self.element.tick * self.element.settings.scale.time

    def cancel(self, command: Command) -> Future[Outcome | None]:
        """Abort the procedure of exactly this command in the next tick.

        Returns:
            The outcome of the abort once the strain is zero; None if the procedure has ended.
        """
        return self._box.submit(Cancel(command))

    def call(self, function: Callable[[], T]) -> Future[T]:
        """Call a function between two ticks, in the loop's thread, paused or not."""
        return self._box.call(function)

    def submit(self, command: Command) -> Future[Outcome | None]:
        """Hand in a command for the next tick.

        Returns:
            The outcome of a procedure when it ends; None for a set-point once it is accepted;
            the exception `Refused` if the command is not accepted.
        """
        if isinstance(command, Disturb):  # check it before it replaces a valid one
            try:
                self.element.base.check(command.acceleration)
            except Refused as refusal:
                answer: Future[Outcome | None] = threads.Future()
                answer.set_exception(refusal)
                return answer
            return self._box.shake(self._pacer.now(), command)
        return self._box.submit(command)

    @property
    def paused(self) -> bool:
        """Whether time is paused."""
        return self._box.paused

    def pause(self, paused: bool) -> Future[int]:
        """Pause or resume time.

        Returns:
            The number of ticks done; when pausing, including the one in progress.
        """
        return self._box.call(lambda: self.element.ticks, paused)

    def single_tick(self) -> Future[int]:
        """Run one tick while paused.

        Returns:
            The number of ticks done after it; the exception `Refused` if time is running.
        """
        return self._box.single_tick()

    # --- in the loop's thread ------------------------------------------------------------

    def _run(self) -> None:
        refusal = Refused(SHUT_DOWN)
        try:
            self._run_ticks()
            if self._box.ending is Ending.FINISH:
                self._let_go()
        except Exception as failure:  # whatever it is, the device reports it and stops
            self.failure = failure
            refusal = Refused(f'the device has stopped: {failure}')
        self._box.close(refusal)
        while self._answers:
            self._answers.popleft().set_exception(refusal)
        if self.failure is not None:
            self._failed()

    def _run_ticks(self) -> None:
        due = self._pacer.now()
        while (turn := self._wait(due)) is not None:
            if turn.batch:
                due = self._make_up(turn.due, turn.batch)
            else:
                ended = self._tick(turn.due, self._take_commands(), turn.asked_for)
                due = math.inf if turn.asked_for else self._after(turn.due, ended)

    def _let_go(self) -> None:
        """Abort any procedure and bring the strain to zero, without pacing."""
        self._box.close(Refused(SHUT_DOWN))
        if self.element.released:
            return
        commands = self._apply(Abort(SHUT_DOWN), threads.Future())
        while not self.element.released:
            self._tick(self._pacer.now(), commands)
            commands = []

    def _make_up(self, due: float, ticks: int) -> float:
        """Run deferred ticks, the first due at a given time; return when the next is due.

        Each run ends at a tick that the listener waits for, or into which an acceleration falls.
        """
        latest = due + ticks * self._period
        while ticks:
            shaken = self._shaken(due + self._period)
            begun, first = self._pacer.now(), self.element.ticks
            until_shaken = (self._box.next_shake() - due) / self._period
            self._advance(int(min(ticks, self._until_published, max(1.0, until_shaken))), shaken)
            run = self.element.ticks - first
            busy = (self._pacer.now() - begun) / run
            for number in range(run):
                self.statistics.count(max(0.0, begun + number * busy - latest), busy)
            due, ticks = due + run * self._period, ticks - run
        return self._after(latest - self._period, self._pacer.now())

    def _tick(self, due: float, commands: list[Stamped], asked_for: bool = False) -> float:
        """Run a tick with the commands that take effect in it; return when it ended.

        Without a pace it may be a run of ticks, unless a single tick was requested.
        """
        begun, first = self._pacer.now(), self.element.ticks
        paced = self._period > 0.0 or asked_for
        self._advance(1 if paced else self._longest_run, commands)
        if asked_for and (done := self._box.take(self._box.single_ticks)) is not None:
            done[0].set_result(self.element.ticks)
        now, ticks = self._pacer.now(), self.element.ticks - first
        self.statistics.count(max(0.0, begun - due), (now - begun) / ticks, ticks)
        return now

    def _advance(self, most: int, commands: list[Stamped]) -> None:
        """Run a tick, or several without decisions; publish the events, then answer."""
        events = self.element.advance(most)
        self._listener(commands, events)
        for event in events:
            if isinstance(event, Outcome):
                self._answers.popleft().set_result(event)

    @property
    def _until_published(self) -> int:
        """Ticks until the next that the listener waits for."""
        return self._publish_every - self.element.ticks % self._publish_every

    @property
    def _longest_run(self) -> int:
        """Ticks of a run without a pace: it delays a command no longer than a rest would."""
        busy = self.statistics.busy
        return max(1, min(self._until_published, int(LONGEST_REST / busy) if busy > 0.0 else 1))

    def _after(self, due: float, now: float) -> float:
        """Return when the next tick is due; count and skip lost time."""
        if self._period == 0.0:
            return now
        lag = now - (due + self._period)
        borne = max(self._period, self._pacer.slack)
        if lag > borne and self.element.foreseen:  # deferred ticks may be late
            deferred = self._at_once > 1 if self._heard() else self._unheard > 0
            borne = max(borne, LONGEST_REST if deferred else 0.0)
        skipped = int(lag / self._period) if lag > borne else 0
        self.statistics.overruns += skipped
        return due + (1 + skipped) * self._period

    def _wait(self, due: float) -> _Turn | None:
        """Make pending calls and wait until ticks are due; None if the loop is to end.

        While time is paused no tick is due, so there is none to make up for.
        """
        box = self._box
        while True:
            if overdue := self._overdue(due):
                return _Turn(due, overdue)
            while (call := box.take(box.calls)) is not None:
                _make(*call)
            with box.changed:
                if box.ending is not Ending.NOT:
                    return None
                self._paused = box.paused
                if box.held:
                    box.changed.wait_for(lambda: not box.held or bool(box.calls))
                    due = math.inf if box.paused else self._pacer.now()
                    continue
                if box.speed != self._paced:
                    self._pace(box.speed)
                now = self._pacer.now()
                if box.single_ticks:
                    return _Turn(min(due, now), asked_for=True)
                due = min(due, now + self._period)  # do not wait for a clock that jumped back
                batch = self._due(now - due)
                wake = due + max(0, batch - 1) * self._period
                if now >= wake:
                    return _Turn(due, batch)
                if not box.calls:
                    self._pacer.wait(box.changed, min(wake - now, LONGEST_SLEEP))

    def _pace(self, speed: float) -> None:
        """Set the speed: the period of a tick, and how many ticks a rest may defer."""
        self._paced = speed
        self._period = self.tick_seconds / speed if speed > 0.0 else 0.0
        self._unheard = int(LONGEST_REST / self._period) if speed > 0.0 else 0
        longest = LONGEST_REST + 1e-9  # tolerates rounding
        self._at_once = max(
            ticks
            for ticks in range(1, self._batch + 1)
            if ticks == 1 or (self._batch % ticks == 0 and 0.0 < ticks * self._period <= longest)
        )

    def _due(self, late: float) -> int:
        """Return the ticks of a batch if the next is late by a given time; 0 if none is due."""
        in_time = self._at_once - self.element.ticks % self._at_once
        ticks = min(in_time - 1 if self._heard() else self._unheard, self.element.foreseen)
        if not ticks or not (self._box.commands or self._box.calls):
            return ticks
        return min(ticks, int(max(0.0, late) / self._period))

    def _overdue(self, due: float) -> int:
        """Return how many deferred ticks come before a pending call, which needs them done."""
        box = self._box
        with box.changed:
            none = self._paused or not box.calls  # a paused loop defers no ticks
            if none or box.ending is not Ending.NOT or box.speed != self._paced:
                return 0
            return self._due(self._pacer.now() - due)

    def _take_commands(self) -> list[Stamped]:
        taken = []
        while (asked := self._box.take(self._box.commands)) is not None:
            taken += self._apply(*asked)
        return taken + self._shaken(math.inf)

    def _shaken(self, before: float) -> list[Stamped]:
        """Apply the accelerations of the base from before a time."""
        asked = self._box.take_shake(before)
        return self._apply(*asked) if asked is not None else []

    def _apply(self, command: Command | Cancel, answer: Future[Outcome | None]) -> list[Stamped]:
        """Apply a command; return it with its tick if it is accepted."""
        if isinstance(command, Cancel):
            if not self.element.runs(command.of):
                answer.set_result(None)
                return []
            command = Abort(CANCELED)
        try:
            self.element.apply(command)
        except Refused as refusal:
            self.statistics.refused += 1
            answer.set_exception(refusal)
            return []
        except Exception as failure:
            answer.set_exception(failure)
            raise
        if isinstance(command, Procedures):
            self._answers.append(answer)
        else:
            answer.set_result(None)
        return [(self.element.ticks, command)]


def _make(function: Callable[[], T], answer: Future[T]) -> None:
    """Call a function, and answer with its result or its exception."""
    try:
        result = function()
    except Exception as failure:
        answer.set_exception(failure)
    else:
        answer.set_result(result)
