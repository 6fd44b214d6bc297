# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Real time: a thread that runs a device's ticks at the pace of a clock.

The clock decides only when the next tick runs, never what it computes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from typing import NamedTuple, TypeVar

from .. import threads
from ..commands import Command, Disturb, Event
from ..element import MemoryElement
from ..errors import ErrorCode, Refused
from ..procedure_table import Abort
from .mailbox import Asked, Cancel, Mailbox, OpenRequests, Request, Resolve, Stamped
from .timetable import LoopStatistics, Pacer, SteadyPacer, Timetable, check_speed

T = TypeVar('T')

Listener = Callable[[Sequence[Stamped], Sequence[Event]], None]
"""Called in the loop's thread after every tick, or run of ticks."""

SHUTDOWN_MESSAGE = 'the device is shut down'


def _refuse_inactive(why: str = SHUTDOWN_MESSAGE) -> Refused:
    return Refused(ErrorCode.INACTIVE, reason=why)


class _Turn(NamedTuple):
    """The loop's next work: a batch of deferred ticks, or one tick that takes the commands."""

    due: float
    batch: int = 0
    asked_for: bool = False


class Loop:
    """Runs a device and hands it commands at tick boundaries.

    Attributes:
        pacer: The clock.
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
        has_subscribers: Callable[[], bool] = lambda: True,
        stream_period: Callable[[], int] = lambda: 1,
        queue: int = 0,
        resolve: Resolve = lambda request: request.resolve(request.outcome),
        failed: Callable[[], None] = lambda: None,
    ) -> None:
        """Prepare a loop; `start` sets it going.

        Args:
            listener: Called after ticks with the commands that they began with and their events.
            speed: Multiple of the scale's real time; 0 runs as fast as possible.
            batch: Most ticks to defer and run together: ticks that matter to the listener must be
                multiples of this number to be on time.
            has_subscribers: Returns whether anybody waits for the ticks that are multiples of
                `batch`; if not, they are deferred like the others, and longer.
            stream_period: Returns a number beyond whose multiples no run of ticks extends, because
                somebody waits for these; 0 if nobody waits for any.
            queue: Most procedures of different clients that wait for their turn.
            resolve: Answers a request whose procedure has ended, at once or later. No command has
                taken effect since.
            failed: Called in the loop's thread after a failure has stopped it.
        """
        self.element = element
        self.statistics = LoopStatistics()
        self.failure: BaseException | None = None
        self._listener = listener
        self.pacer = pacer or SteadyPacer()
        self._failed = failed
        self._box = Mailbox(check_speed(speed))
        self._asked = OpenRequests(element, resolve, self._box.put_back, queue)
        self._paused = False  # as last seen by the loop's thread
        self._times = Timetable(
            element, self.pacer, self.statistics, speed=speed, batch=batch,
            has_subscribers=has_subscribers, stream_period=stream_period,
        )  # fmt: skip
        self._thread = threads.Thread(
            target=self._run_until_closed, name='mlmem-loop', daemon=True
        )

    # --- from any thread -----------------------------------------------------------------

    def start(self) -> None:
        """Let time run, or stand still if it was paused before."""
        self._paused = self._box.paused
        self._thread.start()

    def shut_down(self) -> None:
        """Refuse pending requests, abort any procedure, bring the strain to zero regardless of the
        clock, and end the loop.
        """
        self._box.end()
        if self._thread.is_alive():
            self._thread.join()
        self._box.close(_refuse_inactive())  # if it was never started

    @property
    def speed(self) -> float:
        """Requested multiple of the scale's real time; 0 for as fast as possible."""
        return self._box.speed

    def set_speed(self, speed: float) -> None:
        """Run at a multiple of the scale's real time from now on; 0: as fast as possible.

        Raises:
            SettingsError: It is none; see `check_speed`.
        """
        self._box.set_speed(check_speed(speed))

    def cancel(self, request: Asked) -> Asked:
        """Abort the procedure of exactly this request in the next tick.

        Returns:
            Its answer is the outcome of the abort once the strain is zero; None if the procedure
            has ended.
        """
        cancel: Asked = Request(Cancel(request))
        if not isinstance(request, Request):
            return cancel.refuse(Refused.out_of_range('request', request, 'what submit returned'))
        return self._box.submit(cancel)

    def call(self, function: Callable[[], T]) -> Future[T]:
        """Call a function between two ticks, in the loop's thread, paused or not."""
        return self._box.call(function)

    def refuse_expired(self) -> None:
        """Refuse requests that have waited for too long."""
        if self._asked.waiting:
            self._box.call(self._asked.refuse_expired)

    def submit(self, command: Command, wait: float | None = None) -> Asked:
        """Hand in a command for the next tick; a procedure may wait for its turn for so many
        seconds, and is refused without them while another runs.

        Returns:
            Its answer is the outcome of a procedure when it ends, and None for what begins none,
            once it is accepted.
        """
        if isinstance(command, Disturb):  # check it before it replaces a valid one
            try:
                self.element.base.check(command.acceleration)
            except Refused as refusal:
                return Request(command).refuse(refusal)
            return self._box.post_acceleration(self.pacer.now(), command)
        request: Asked = Request(command)
        if wait is not None:
            request.waits, request.deadline = True, threads.monotonic() + wait
        return self._box.submit(request)

    @property
    def is_paused(self) -> bool:
        """Whether time is paused."""
        return self._box.paused

    @property
    def is_stepping(self) -> bool:
        """Whether ticks are run that were asked for while time is paused."""
        return bool(self._box.steps)

    def pause(self, paused: bool) -> Future[int]:
        """Pause or resume time, which ends the ticks that are asked for; the answer is the number
        of ticks done, when pausing including the one in progress.
        """
        return self._box.call(lambda: self.element.ticks, paused)

    def step(self, ticks: int = 1) -> Request[int]:
        """Run ticks while paused; the answer is the number of all ticks after the last, once its
        events are published, or the exception `Refused` if time is running.
        """
        return self._box.step(ticks)

    # --- in the loop's thread ------------------------------------------------------------

    def _run_until_closed(self) -> None:
        refusal = _refuse_inactive()
        try:
            self._run_ticks()
            self._release_strain()
        except BaseException as failure:  # whatever it is, the device reports it and stops
            self.failure = failure
            refusal = _refuse_inactive(f'the device has stopped: {failure}')
        self._box.close(refusal)
        self._asked.refuse(refusal)
        if self.failure is not None:
            self._failed()

    def _run_ticks(self) -> None:
        due, made_up = self.pacer.now(), False
        while (turn := self._wait_until_due(due, made_up)) is not None:
            made_up = turn.batch > 0
            if turn.batch:
                due = self._run_deferred(turn.due, turn.batch)
            else:
                commands: list[Stamped] = []
                while (request := self._box.take_request(self._box.commands)) is not None:
                    commands += self._asked.apply(request)
                ended = self._run_tick(turn.due, commands, turn.asked_for)
                due = math.inf if turn.asked_for else self._times.schedule_next(turn.due, ended)

    def _release_strain(self) -> None:
        """Abort any procedure and bring the strain to zero, without pacing."""
        self._box.close(_refuse_inactive())
        if self.element.is_released:
            return
        abort = Abort(SHUTDOWN_MESSAGE)
        commands: list[Stamped] = [(self.element.ticks, abort)]
        self.element.apply(abort)
        while not self.element.is_released:
            self._run_tick(self.pacer.now(), commands)
            commands = []

    def _run_deferred(self, due: float, ticks: int) -> float:
        """Run deferred ticks, the first due at a given time; return when the next is due.

        Each run ends at a tick that the listener waits for. Accelerations take effect within it;
        while a procedure runs, which may listen, only in its first tick.
        """
        period, self._times.slept = self._times.period, False
        latest = due + ticks * period
        while ticks:
            begun, first = self.pacer.now(), self.element.ticks
            most = self._times.limit_run(ticks)
            within = 1 if self.element.procedure else most
            shakes = self._box.take_shakes(due, period, within)
            if within < most:
                until_shaken = (self._box.find_next_shake() - due) / period
                most = int(min(most, max(1.0, until_shaken)))
            self._advance_element(most, [], shakes)
            run = self.element.ticks - first
            busy = (self.pacer.now() - begun) / run
            if self.element.computed <= first:  # it rested
                self.statistics.count(max(0.0, begun - latest), busy, run)
            else:
                self._times.record_duration(busy)
                for number in range(run):
                    self.statistics.count(max(0.0, begun + number * busy - latest), busy)
            due, ticks = due + run * period, ticks - run
        return self._times.schedule_next(latest - period, self.pacer.now())

    def _run_tick(self, due: float, commands: list[Stamped], asked_for: bool = False) -> float:
        """Run a tick with the commands that take effect in it; return when it ended.

        Without a pace it may be a run of ticks, unless a single tick was requested.
        """
        begun, first = self.pacer.now(), self.element.ticks
        paced = self._times.period > 0.0 or asked_for
        shakes = self._box.take_shakes()
        self._advance_element(1 if paced else self._times.longest_run, commands, shakes)
        if asked_for:
            self._box.count_step(self.element.ticks)
        now, ticks = self.pacer.now(), self.element.ticks - first
        self.statistics.count(max(0.0, begun - due), (now - begun) / ticks, ticks)
        return now

    def _advance_element(
        self, most: int, commands: list[Stamped], shakes: Mapping[int, Disturb]
    ) -> None:
        """Run a tick, or several without decisions; publish the events, then answer."""
        first = self.element.ticks
        commands += [(first + tick, command) for tick, command in shakes.items()]
        events = self.element.advance(
            most, {tick: command.acceleration for tick, command in shakes.items()}
        )
        self._listener(commands, events)
        self._asked.resolve()

    def _wait_until_due(self, due: float, made_up: bool) -> _Turn | None:
        """Make pending calls and wait until ticks are due; None if the loop is to end.

        While time is paused no tick is due, so there is none to make up for. At a speed beyond the
        machine there always is, so who waits comes next when ticks were just `made_up`.
        """
        box, times = self._box, self._times
        while True:
            if (left := self._asked.deadline - threads.monotonic()) <= 0.0:
                self._asked.refuse_expired()
                continue
            if not made_up and (overdue := self._count_overdue(due)):
                return _Turn(due, overdue)
            while (call := box.take_request(box.calls)) is not None:
                try:
                    result = call.asked()
                except Exception as failure:
                    call.refuse(failure)
                else:
                    call.resolve(result)
            with box.changed:
                if box.ending:
                    return None
                self._paused = box.paused
                if box.is_held:
                    within = None if left == math.inf else left
                    box.changed.wait_for(lambda: not box.is_held or bool(box.calls), within)
                    due = math.inf if box.paused else self.pacer.now()
                    continue
                now = self.pacer.now()
                if box.speed != times.speed:
                    if (
                        times.slept
                        and (ticks := times.count_deferred(now - due, box))
                        and now >= due
                    ):
                        return _Turn(due, min(ticks, 1 + int((now - due) / times.period)))
                    times.slept = False
                    times.set_speed(box.speed)
                if box.steps:
                    return _Turn(min(due, now), asked_for=True)
                due = min(due, now + times.period)  # do not wait for a clock that jumped back
                batch = 0 if made_up and box.commands else times.count_deferred(now - due, box)
                wake = times.find_wake_time(due, batch)
                if now >= wake:
                    return _Turn(due, batch)
                if not box.calls:
                    box.asleep = times.can_sleep(batch)
                    times.slept |= box.asleep
                    self.pacer.wait(box.changed, min(wake - now, times.max_sleep))
                    box.asleep = False
                made_up = False

    def _count_overdue(self, due: float) -> int:
        """Return how many deferred ticks come before a pending call, which needs them done."""
        box = self._box
        with box.changed:
            none = self._paused or not box.calls  # a paused loop defers no ticks
            if none or box.ending or box.speed != self._times.speed:
                return 0
            return self._times.count_deferred(self.pacer.now() - due, box)
