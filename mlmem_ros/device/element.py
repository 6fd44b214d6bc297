# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The memory element: takes commands, and runs procedures on its instrument."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ..clipped import clipped
from . import commands, procedures
from .commands import Command, Procedures
from .end import BOTH, End
from .errors import ProcedureFailed, Refused
from .events import Event, Outcome
from .instrument import LONGEST_RUN
from .memory import Memory
from .procedures import Procedure, Result
from .progress import Feedback, Progress

FAR = 2**31
"""More ticks than are ever run."""


class MemoryElement(Memory):
    """A device that advances by ticks and takes commands between them; made like a `Memory`."""

    _running: _Run | None = None

    # --- commands ------------------------------------------------------------------------

    @property
    def procedure(self) -> str:
        """Name of the running procedure, empty when there is none."""
        return self.progress.procedure if self._running else ''

    def runs(self, command: object) -> bool:
        """Return whether the running procedure belongs to exactly this command."""
        run = self._running  # another thread may end it meanwhile
        return run is not None and run.command is command

    def feedback(self) -> Feedback:
        """Return the progress of the running procedure; any thread may call it."""
        progress = self.progress
        share = progress.share(self.ticks)
        return Feedback(progress.phase, share, self.linkage.encoder, progress.attempts)

    @property
    def resting(self) -> bool:
        """Whether no procedure runs, and strain and base stand still."""
        return not self._running and super().resting

    @property
    def foreseen(self) -> int:
        """Ticks until the next decision if no command comes, which can be run later together.

        It is 0 for a real element that moves, because that cannot be delayed.
        """
        if self._running:
            return self._running.due - self.ticks if self.simulated else 0
        return FAR if self.simulated or self.resting else 0

    @property
    def released(self) -> bool:
        """Whether no procedure runs, and the strain is zero and stays zero."""
        actuator = self.actuator
        return not (self._running or actuator.moving or actuator.strain)

    def apply(self, command: Command) -> None:
        """Take a command; it takes effect in the next tick.

        Raises:
            Refused: A procedure runs, or a value is out of range; nothing is changed.
        """
        match command:  # allowed at any time
            case commands.Abort(why):
                self._abort(command, why)
                return
            case commands.Disturb(acceleration):
                self.base.disturb(acceleration)
                return
            case commands.SetFaults(faults):
                self.suffer(faults)
                return
        if self._running:
            raise Refused(f'busy: {self.procedure} is running; abort it or wait')
        match command:
            case commands.SetStrain(strain):
                self.actuator.slew_to(strain)
                self.forget()
            case commands.FollowTrajectory():
                self.actuator.follow(command, self.settings.scale.time)
                self.forget()
            case commands.Write(level):
                self._check_level(level)
                self._run(command, 'write', procedures.write(self, level))
            case commands.Read(end):
                if end not in ('', *End, BOTH):
                    raise Refused(f'end must be left, right or both; got {clipped(end)}')
                self._run(command, 'read', procedures.read(self, end))
            case commands.Erase():
                self._run(command, 'erase', procedures.erase(self))
            case commands.Calibrate():
                self._run(command, 'calibrate', procedures.calibrate(self))
            case commands.SelfTest():
                self._run(command, 'self_test', procedures.self_test(self))
            case _:
                known = ', '.join(commands.KINDS)
                raise Refused(f'command must be one of {known}; got {clipped(command)}')

    def _check_level(self, level: int) -> None:
        last = self.design.levels - 1
        if isinstance(level, bool) or not isinstance(level, int) or not 0 <= level <= last:
            raise Refused(f'level must be a whole number from 0 to {last}; got {clipped(level)}')

    def _abort(self, command: Command, why: str) -> None:
        if self._running:
            self._running.steps.close()
            self._end(False, f'aborted: {why}' if why else 'aborted', Result(None))
            self.statistics.aborted += 1
        self._run(command, 'abort', procedures.abort(self))

    def _run(self, command: Command, name: str, steps: Procedure[Result]) -> None:
        self.progress = Progress(name, self.ticks)  # first: other threads read `procedure`
        self._running = _Run(command, steps, self.ticks)

    # --- time ----------------------------------------------------------------------------

    def advance(self, most: int = 1) -> list[Event]:
        """Advance by a tick, or by a run of ticks without decisions.

        Results and events do not depend on how time is divided into runs, to the bit.

        Args:
            most: Most ticks of the run.

        Returns:
            The events of the first tick; the others have none.

        Raises:
            StateError: The material cannot continue (see `Chain.advance`). It is as before the
                failing tick, the procedure has failed, and strain and base stand still.
            DriverError: As in `pass_ticks`; the procedure has failed.
        """
        ticks = self._step(self._running) if self._running else most
        if self.base.harmful:
            self.forget()
        if self._events:  # reported after the first
            ticks = 1
        self.pass_ticks(min(ticks, most))
        events, self._events = self._events, []
        return events

    def perform(self, command: Procedures, between: Callable[[], object] | None = None) -> Outcome:
        """Apply a command and advance until its procedure has ended; return its outcome.

        If given, `between` is called between two ticks.

        Raises:
            Refused: As in `apply`.
            StateError: As in `advance`.
        """
        self.apply(command)
        while True:
            for event in self.advance(LONGEST_RUN if between is None else 1):
                if isinstance(event, Outcome):
                    return event
            if between is not None:
                between()

    def _step(self, run: _Run) -> int:
        """Resume a procedure; return after how many ticks to resume it again."""
        try:
            ticks = next(run.steps)
        except StopIteration as stop:
            result: Result = stop.value
            failed = ', '.join(check.name for check in result.checks if not check.passed)
            self._finish(not failed, f'failed: {failed}' if failed else '', result)
        except ProcedureFailed as failure:
            result = Result(self.reading, failure.attempts)
            self._finish(False, str(failure), result)
        else:
            run.due = self.ticks + ticks
            return ticks
        return 1

    def stand_still(self, why: str) -> None:
        """End everything under way after a failed tick."""
        super().stand_still(why)
        self.forget()
        if self._running:
            self._running.steps.close()
            self.statistics.count(self._end(False, why, Result(None)))

    def _finish(self, success: bool, error: str, result: Result) -> None:
        """End the running procedure, successful or not: release cells, return the strain to zero.

        A read keeps a strain that was set by hand.
        """
        outcome = self._end(success, error, result)
        self.statistics.count(outcome)
        self.transducer.release()
        if outcome.procedure != 'read' and self.actuator.motion.target != 0.0:
            self.actuator.ramp_to(0.0, self.settings.erase.release)

    def _end(self, success: bool, error: str, result: Result) -> Outcome:
        self._running = None
        outcome = Outcome(
            self.progress.procedure,
            success,
            error,
            result.reading,
            result.attempts,
            self.progress.start_tick,
            self.ticks,
            result.checks,
            result.delays,
        )
        self._events.append(outcome)
        return outcome


@dataclass(eq=False)
class _Run:
    """A running procedure, and the tick in which to resume it."""

    command: Command
    steps: Procedure[Any]
    due: int
