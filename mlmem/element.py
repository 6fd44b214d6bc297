# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The memory element: takes commands, runs procedures on its instrument."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from . import commands, factory, procedures
from .commands import Command, Event, Feedback, Outcome
from .element_file import Element
from .errors import ErrorCode, OutcomeCode, ProcedureFailed, Refused, SettingsError
from .instrument.base import NO_SHAKES, Shakes
from .instrument.blocks import MAX_RUN_TICKS
from .instrument.drivers import Driver, Simulation
from .instrument.end import End
from .instrument.faults import Faults
from .instrument.instrument import Progress
from .memory import Memory
from .physics import Material, as_design
from .procedure_table import PROCEDURES, Abort, Procedures
from .procedures import Procedure
from .readers.calibration import Calibration
from .readers.reading import find_failure_code
from .schema import find_descriptions, find_problems
from .settings import Settings


class MemoryElement(Memory):
    """A device that advances by ticks and takes commands between them."""

    def __init__(
        self,
        element: Element | Material,
        settings: Settings | None = None,
        calibration: Calibration | None = None,
        driver: Driver | None = None,
    ) -> None:
        """Make a calibrated device, blank unless a driver has its own element; levels with known
        bad cells have been rehearsed.

        Args:
            element: What `load_element` returns, or a design or specimen. A fitted element is
                simulated as it was fitted.
            settings: The instrument's settings; by default the element's, or those for Case II.
            calibration: A known calibration for them; by default the factory's.
            driver: The driver of a real element; by default that of a simulated one.

        Raises:
            SettingsError: A level gives no echo, or levels cannot be told apart by their echoes.
            DesignError: It is not a memory, or the step is beyond the stability limit.
        """
        material: Material
        if isinstance(element, Element):
            material, known = element.timed_specimen, element.settings
        else:
            material, known = element, Settings()
        design, settings = as_design(material), settings or known
        design.require_memory()
        if calibration is None:
            calibration = factory.factory_calibration(design, settings)
        if driver is None:
            driver = Simulation.build_blank(material, settings.time)
        rehearsed = (
            factory.rehearse_levels(design, settings) if settings.element.bad_cells else None
        )
        super().__init__(design, settings, calibration, driver, rehearsed)
        self._running: ProcedureRun | None = None

    # --- commands ------------------------------------------------------------------------

    @property
    def procedure(self) -> str:
        """Name of the running procedure, empty when there is none."""
        return self.progress.procedure if self._running else ''

    def is_running(self, run: ProcedureRun | None) -> bool:
        """Return whether a procedure is under way."""
        return run is not None and run is self._running

    def get_feedback(self) -> Feedback:
        """Return the progress of the running procedure."""
        progress = self.progress
        share = progress.find_elapsed_share(self.ticks)
        return Feedback(progress.phase, share, self.transmission.encoder_strain, progress.attempts)

    @property
    def is_still(self) -> bool:
        """Whether no procedure runs, and strain and base stand still."""
        return not self._running and super().is_still

    @property
    def at_rest(self) -> bool:
        """Whether no procedure runs, and ticks change nothing but clocks."""
        return not self._running and not self._events and super().at_rest

    @property
    def idle_ticks(self) -> int:
        """Ticks until the next decision if no command comes, which can be run later together.

        It is 0 for a real element that moves, because that cannot be delayed.
        """
        if not self.is_simulated and (self._running or not self.is_still):
            return 0
        return self._running.due - self.ticks if self._running else 2**31  # more than are ever run

    @property
    def is_released(self) -> bool:
        """Whether no procedure runs, and the strain is zero and stays zero."""
        actuator = self.actuator
        return not (self._running or actuator.is_moving or actuator.strain)

    def apply(self, command: Command) -> ProcedureRun | None:
        """Take a command, which takes effect in the next tick; return the procedure that it
        begins, or None.

        Raises:
            Refused: A procedure runs, or a value is out of range; nothing is changed.
        """
        name = next(
            (name for name, row in PROCEDURES.items() if row.command is type(command)), None
        )
        wanted = self.check_arguments(command) if name is not None else {}
        match command:  # allowed at any time
            case Abort(why):
                self._abort_procedure(f'aborted: {why}' if why else 'aborted')
                if self.actuator.strain != 0.0 or self.actuator.is_moving:
                    self.forget_content('aborted')
            case commands.Disturb(acceleration):
                self.base.accept_acceleration(acceleration)
                return None
            case commands.SetFaults(faults):
                if not isinstance(faults, Faults):
                    raise Refused.out_of_range('faults', faults, 'Faults')
                before = self.faults
                self.set_faults(faults)
                if not faults.has_same_material(before):
                    self.forget_content('faults were set')
                return None
            case commands.SetMethod(method):
                self._set_method(method)
                return None
        if self._running:
            why = f'busy: {self.procedure} is running; abort it or wait'
            raise Refused(ErrorCode.BUSY, reason=why)
        if name is not None:
            return self._begin_procedure(name, wanted)
        match command:
            case commands.SetStrain() | commands.FollowTrajectory() if (
                not self.settings.actuator.present
            ):
                raise Refused(
                    ErrorCode.UNSUPPORTED, 'actuator.present', False, 'true for a strain'
                )
            case commands.SetStrain(strain):
                if not self.actuator.slew_to(strain):
                    return None
            case commands.FollowTrajectory():
                self.actuator.follow_profile(command, self.settings.scale.time)
            case _:
                known = ', '.join(commands.COMMANDS_BY_NAME)
                raise Refused.out_of_range('command', command, f'one of {known}')
        self.forget_content('strained by hand')
        return None

    def _set_method(self, method: str) -> None:
        """Write by another method, and read by its pulses."""
        try:
            write = replace(self.settings.write, method=method)
        except SettingsError as error:
            raise Refused.of_error(error, 'write') from error
        try:
            settings = replace(self.settings, write=write)
            self.transducer.set_probes(settings)
        except SettingsError as error:
            raise Refused.of_error(error) from error
        self.settings = settings

    def forget_content(self, reason: str, after: int = 0) -> None:
        """Treat the content as unknown, and say so at once; of what a procedure does, its outcome
        says it.
        """
        known = self.reading is not None
        super().forget_content(reason, after)
        if known and self.unknown is not None and not self._running:
            self._events.append(self.unknown)

    def check_arguments(self, command: Command) -> dict[str, Any]:
        """Return the arguments of a procedure, which are right.

        Raises:
            Refused: One is out of range, or a bad cell makes a level unusable.
        """
        most = self.reader.content_count - 1
        for field, value, expected in find_problems(command, level=most, content=most):
            name = self.content_name if field == 'level' else field
            raise Refused.out_of_range(name, value, expected)
        wanted = {
            field.name: getattr(command, field.name) for field, _ in find_descriptions(command)
        }
        for field in {'level', 'content'} & wanted.keys():
            if why := self.reader.unusable_reasons.get(wanted[field]):
                reason = f'{wanted[field]} {why}'
                raise Refused(ErrorCode.UNSUPPORTED, field, wanted[field], reason=reason)
        return wanted

    def _check_amplitudes(self) -> None:
        """Raise `Refused` if a pulse may move the wall."""
        for end, loudest in self.loudest.items():
            if (A := self.transducer.probes[end].A) > loudest:
                group = 'probe' if end is End.LEFT else 'probe_right'
                expected = f'at most {loudest:.3g}, or a pulse may move the wall'
                raise Refused(ErrorCode.CONFLICT, f'{group}.A', A, expected)

    def _begin_procedure(self, name: str, wanted: dict[str, Any]) -> ProcedureRun:
        row = PROCEDURES[name]
        if row.both_ends and self.settings.has_one_transducer:
            expected = f'delay or waveform for {name}, which needs a transducer at both ends'
            raise Refused(ErrorCode.UNSUPPORTED, 'read.method', 'records', expected)
        if row.listens:
            self._check_amplitudes()
        if (
            row.listens
            and name not in ('calibrate', 'reset')
            and self.reader.needs_calibration(self)
        ):
            expected = f'delay or waveform for {name}, or calibrate the element first'
            raise Refused(ErrorCode.UNSUPPORTED, 'read.method', 'records', expected)
        begin, estimate_duration = procedures.STEPS[name]
        try:
            duration = estimate_duration(self, **wanted)
        except ProcedureFailed as error:  # there is no way, as without an actuator
            raise Refused.of_error(error, code=ErrorCode.UNSUPPORTED) from error
        self.progress = Progress(name, self.ticks)
        self.expect_duration(duration)
        self._running = ProcedureRun(begin(self, **wanted), self.ticks)
        return self._running

    def _abort_procedure(self, why: str) -> None:
        """End the running procedure, if there is one."""
        if self._running:
            self._running.steps.close()
            self._end_procedure(Outcome(None, code=OutcomeCode.ABORTED, error=why))
            self.statistics.aborted += 1
            if self.unknown is not None and self.unknown.since >= self.progress.start_tick:
                self.unknown = replace(self.unknown, reason='aborted')

    # --- time ----------------------------------------------------------------------------

    def advance(self, most: int = 1, shakes: Shakes = NO_SHAKES) -> list[Event]:
        """Advance by a tick, or by a run of ticks without decisions.

        Results and events do not depend on how time is divided into runs, to the bit.

        Args:
            most: Most ticks of the run.
            shakes: Accelerations of the base that take effect within the run. While a procedure
                runs, which may listen, only in its first tick.

        Returns:
            The events of the first tick. The others have none, but for an acceleration of theirs
            that makes the content unknown: that event names its tick.

        Raises:
            StateError: The material cannot continue (see `Chain.advance`). It is as before the
                failing tick, the procedure has failed, and strain and base stand still.
            DriverError: As in `pass_ticks`; the procedure has failed.
            Refused: An acceleration is beyond the limit (see `Base.check`).
        """
        for acceleration in shakes.values():
            self.base.check(acceleration)
        if 0 in shakes:  # as `apply` does, before a procedure looks at it
            self.base.accept_acceleration(shakes[0])
        ticks = self._resume_procedure(self._running) if self._running else most
        shaken = self.base.find_harmful_tick(shakes)
        if shaken == 0:
            self.transducer.shaken = True
            self.forget_content('shaken')
        if self._events:  # reported after the first
            ticks = 1
        ticks = min(ticks, most)
        if shaken is not None and shaken < ticks:
            self.forget_content('shaken', shaken)
        self.pass_ticks(ticks, shakes)
        events, self._events = self._events, []
        return events

    def perform(self, command: Procedures, between: Callable[[], object] | None = None) -> Outcome:
        """Apply a command and advance until its procedure has ended; return its outcome.

        If given, `between` is called between two ticks.

        Raises:
            Refused: It begins no procedure, or as in `apply`.
            StateError: As in `advance`.
        """
        if not isinstance(command, Procedures):
            known = ', '.join(row.command.__name__ for row in PROCEDURES.values())
            raise Refused.out_of_range('command', command, f'one of {known}')
        run = self.apply(command)
        assert run is not None
        while run.outcome is None:
            self.advance(MAX_RUN_TICKS if between is None else 1)
            if between is not None and run.outcome is None:
                between()
        return run.outcome

    def _resume_procedure(self, run: ProcedureRun) -> int:
        """Resume a procedure; return after how many ticks to resume it again."""
        try:
            ticks = next(run.steps)
        except StopIteration as stop:
            self._finish_procedure(stop.value)
        except ProcedureFailed as failure:
            error = f'{failure}{self._describe_remedy()}'
            code = find_failure_code(self.reading)
            self._finish_procedure(Outcome(self.reading, failure.attempts, code=code, error=error))
        else:
            run.due = self.ticks + ticks
            return ticks
        return 1

    def stop_after_failure(self, why: str) -> None:
        """End everything under way after a failed tick."""
        super().stop_after_failure(why)
        self.forget_content(why)
        if self._running:
            self._running.steps.close()
            error = f'{why}{self._describe_remedy()}'
            self.statistics.count(
                self._end_procedure(Outcome(None, code=OutcomeCode.FAILED, error=error))
            )

    def _describe_remedy(self) -> str:
        """Return what to do about cells that have left their phases, as far as the ends show.

        Kicks that went astray are right again once they are calibrated.
        """
        if None not in self.phases or self.procedure == 'reset':
            return ''
        reset = ', and if this remains so without faults, reset replaces it by a blank one'
        return f'; calibrate the element{reset if self.is_simulated else ""}'

    def _finish_procedure(self, ended: Outcome) -> None:
        """End the running procedure, successful or not: release cells, return the strain to zero.

        What changes nothing, such as a read, keeps a strain that was set by hand.
        """
        outcome = self._end_procedure(ended)
        self.statistics.count(outcome)
        self.transducer.release_ends()
        if PROCEDURES[outcome.procedure].changes and self.actuator.motion.target != 0.0:
            self.actuator.ramp_to(0.0, self.settings.erase.release)

    def _end_procedure(self, ended: Outcome) -> Outcome:
        run, self._running = self._running, None
        assert run is not None
        run.outcome = replace(
            ended, procedure=self.progress.procedure, start_tick=self.progress.start_tick,
            end_tick=self.ticks, content_name=self.content_name,
        )  # fmt: skip
        self._events.append(run.outcome)
        return run.outcome


@dataclass(eq=False)
class ProcedureRun:
    """A procedure under way."""

    steps: Procedure[Any]
    due: int
    outcome: Outcome | None = None
