# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The memory element as an instrument: material, actuator, transducers and procedures."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..clipped import clipped
from ..physics import (
    INTEGRATORS,
    Chain,
    Design,
    DesignError,
    Specimen,
    StateError,
    default_step,
    substep_times,
)
from . import procedures
from .actuator import Actuator
from .base import Base, BaseState
from .calibration import Calibration
from .commands import (
    KINDS,
    Abort,
    Calibrate,
    Command,
    Disturb,
    Erase,
    FollowTrajectory,
    Read,
    SelfTest,
    SetFaults,
    SetStrain,
    Write,
)
from .echo import Echo
from .errors import ProcedureFailed, Refused, SettingsError
from .events import Event, Heard, Outcome
from .faults import HEALTHY, Faults, worn
from .linkage import Linkage
from .memory_statistics import MemoryStatistics
from .procedures import Procedure, Result
from .reading import Reading, combine, confirmed, decode, phase_of
from .sensor_faults import sensed
from .settings import Settings, TimeSettings
from .transducer import ENDS, Transducer
from .units import Units

MOST_WORK = 10**8
"""Cell steps of a tick, those of at least a thousand cells: a quarter of a second or so."""


def steps_per_tick(design: Design, time: TimeSettings) -> int:
    """Return the least number of steps of a tick that are accurate and stable.

    Raises:
        SettingsError: The tick would take so many that nothing could be done beside it.
    """
    dt = default_step(Specimen(design), INTEGRATORS[time.integrator])
    steps, most = math.ceil(time.tick / dt), MOST_WORK // max(design.N, 1000)
    if steps > most:
        raise SettingsError(
            f'time.tick must be at most {most * dt:.4g}, which is {most} steps of this design; '
            f'got {time.tick:g}'
        )
    return steps


class MemoryElement:
    """A device that advances by ticks and takes commands between them.

    Attributes:
        design: The element.
        settings: The instrument's settings.
        chain: The material.
        actuator: Tells the strain of the substrate.
        linkage: Brings that strain to the substrate.
        base: What the element stands on.
        faults: What is wrong; set by a command.
        transducer: Drives and senses the ends.
        calibration: Echo delay of every level.
        reading: The last reading, None while the content is not known.
        statistics: What the element has been through.
        ticks: Ticks since the device was made: its clock.
        tick: Length of a tick in time units.
        substrate_speed: Mean speed of the substrate's end in the last tick.
    """

    def __init__(self, design: Design, settings: Settings, calibration: Calibration) -> None:
        """Make a device around a blank chain at rest.

        Args:
            design: The element.
            settings: The instrument's settings.
            calibration: Echo delay of every level; `factory.new_element` makes one.

        Raises:
            SettingsError: The calibration is that of another number of levels, or the device
                would have to take too many steps or samples.
        """
        calibration.check(design.levels)
        self.design = design
        self.settings = settings
        self.tick = settings.time.tick
        self.steps_per_tick = steps_per_tick(design, settings.time)
        integrator = INTEGRATORS[settings.time.integrator]
        self.chain = Chain(design, self.tick / self.steps_per_tick, integrator)
        self.actuator = Actuator(settings.actuator)
        self.linkage = Linkage(settings.actuator.max_rate)
        self.base = Base(settings.disturbance, self.tick, design.holding_force)
        self.faults = HEALTHY
        probes = {'left': settings.probe, 'right': settings.probe_right}
        self.transducer = Transducer(self.chain, probes)
        self.calibration = calibration
        self.reading: Reading | None = None
        self.statistics = MemoryStatistics.of(design.levels)
        self.ticks = 0
        self.substrate_speed = 0.0
        self._times = substep_times(self.steps_per_tick, self.chain.dt, integrator)
        self._substeps = np.diff(self._times, prepend=0.0)
        self._progress = self._times / self.tick
        self._running: _Run | None = None
        self._events: list[Event] = []

    # --- commands ------------------------------------------------------------------------

    @property
    def procedure(self) -> str:
        """Name of the running procedure, empty when there is none."""
        return self._running.name if self._running else ''

    @property
    def units(self) -> Units:
        """What its units are in SI."""
        return Units(self.design, self.settings.scale)

    @property
    def resting(self) -> bool:
        """Whether nothing is under way: no procedure runs, strain and base stand still."""
        return not (self._running or self.actuator.moving) and self.base.still

    @property
    def idle(self) -> bool:
        """Whether no procedure runs, and no strain is on or on its way."""
        actuator = self.actuator
        return not (self._running or actuator.moving or actuator.strain)

    def apply(self, command: Command) -> None:
        """Take a command; it takes effect in the next tick.

        Raises:
            Refused: A procedure runs, or a value is out of range; nothing is changed.
        """
        match command:  # what may come at any time
            case Abort(why):
                self._abort(why)
                return
            case Disturb(acceleration):
                self.base.disturb(acceleration)
                return
            case SetFaults(faults):
                self.suffer(faults)
                return
        if self._running:
            raise Refused(f'busy: {self._running.name} is running; abort it or wait')
        match command:
            case SetStrain(strain):
                self.actuator.slew_to(strain)
                self.forget()
            case FollowTrajectory():
                self.actuator.follow(command, self.settings.scale.time)
                self.forget()
            case Write(level):
                self._check_level(level)
                self._run('write', procedures.write(self, level))
            case Read(end):
                if end not in ('', *ENDS, 'both'):
                    raise Refused(f'end must be left, right or both; got {clipped(end)}')
                self._run('read', procedures.read(self, end))
            case Erase():
                self._run('erase', procedures.erase(self))
            case Calibrate():
                self._run('calibrate', procedures.calibrate(self))
            case SelfTest():
                self._run('self_test', procedures.self_test(self))
            case _:
                raise Refused(f'command must be one of {", ".join(KINDS)}; got {clipped(command)}')

    def _check_level(self, level: int) -> None:
        last = self.design.levels - 1
        if isinstance(level, bool) or not isinstance(level, int) or not 0 <= level <= last:
            raise Refused(f'level must be a whole number from 0 to {last}; got {clipped(level)}')

    def specimen(self, faults: Faults) -> Specimen:
        """Return the material with faults; it may be asked for from any thread.

        Raises:
            Refused: The design has no such cell, or the step is too long for this material.
        """
        try:
            specimen = worn(self.design, faults)
            self.chain.check(specimen)
        except (SettingsError, DesignError) as error:
            raise Refused(f'faults: {error}') from error
        return specimen

    def suffer(self, faults: Faults) -> None:
        """Be faulty in these ways, and in no other; raises as `specimen`, nothing changed."""
        self.chain.become(self.specimen(faults))
        self.faults = faults

    def _abort(self, why: str) -> None:
        if self._running:
            self._running.steps.close()
            self._end(False, f'aborted: {why}' if why else 'aborted', Result(None))
            self.statistics.aborted += 1
        self._run('abort', procedures.abort(self))

    def _run(self, name: str, steps: Procedure[Result]) -> None:
        self._running = _Run(name, steps, self.ticks)

    # --- what procedures tell ------------------------------------------------------------

    def phase(self, end: str) -> int | None:
        """Return the phase an end rests in: 0 inactive, 1 active, None in between."""
        strain = self.linkage.encoder
        substrate = 0.0 if end == 'left' else self.design.end_displacement(strain)
        return phase_of(self.design, self.transducer.rest(end) - substrate)

    def forget(self) -> None:
        """Hold the content for unknown from now on: the wall may be about to move."""
        self.reading = None

    def hear(
        self, echo: Echo, left: Reading | None = None, said: list[int] | None = None
    ) -> Reading:
        """Decode an echo, remember the reading and tell it.

        Args:
            echo: What came back.
            left: What the left end has said just before, to be combined with an echo at the
                right end.
            said: The levels that the pulses before have said, to which this one's is added: while
                the base shakes, two have to say the same.
        """
        phases = self.phase('left'), self.phase('right')
        reading = decode(self.design, self.settings.read, self.calibration, echo, phases)
        if left is not None:
            reading = combine(self.design, self.settings.read, left, reading)
        if said is not None:
            said.append(reading.level)
            if echo.shaken:
                reading = confirmed(reading, said)
        self.reading = reading
        self._events.append(Heard(echo, reading))
        return reading

    # --- time ----------------------------------------------------------------------------

    def advance(self) -> list[Event]:
        """Advance by one tick and return what happened in it.

        Raises:
            StateError: The material cannot go on (see `Chain.advance`). It is as it was before
                this tick, the procedure has failed, and strain and base stand still.
        """
        if self._running:
            self._step(self._running)
        if self.base.harmful:
            self.forget()
        strain_before, linkage_before = self.actuator.strain, self.linkage.state
        shake = self.base.advance(self._progress)
        told = self.actuator.advance(self._times)
        strain = self.linkage.advance(told, self._substeps, self.faults, self.ticks)
        drive = self.transducer.drive(self.steps_per_tick)
        V_N = strain * self.design.end_displacement(1.0)
        self.substrate_speed = (float(V_N[-1]) - self.chain.V_N) / self.tick
        try:
            ends = self.chain.advance(V_N, drive, shake)
        except StateError as error:
            self.actuator.hold(strain_before)
            self.linkage.state = linkage_before
            self._stand_still(str(error))
            raise
        last = self.transducer.recent[:, -1]
        self.transducer.record(sensed(ends, last, self.faults, self.ticks))
        self.ticks += 1
        events, self._events = self._events, []
        return events

    def rest(self, ticks: int) -> None:
        """Advance by ticks while the device is `resting`: as by `advance`, to the bit.

        The material's loop is called once for all of them.

        Raises:
            StateError: As by `advance`, for all of these ticks.
        """
        alike = self.transducer.idle and self.linkage.state.true and self.faults == HEALTHY
        if not (self.resting and alike):  # a fault may make one tick unlike the next
            for _ in range(ticks):
                self.advance()
            return
        try:
            ends = self.chain.rest(ticks * self.steps_per_tick)
        except StateError as error:
            self._stand_still(str(error))
            raise
        self.actuator.rest(self._times, ticks)
        self.substrate_speed = 0.0
        self.transducer.record(ends)
        self.ticks += ticks

    def _step(self, run: _Run) -> None:
        try:
            next(run.steps)
        except StopIteration as stop:
            result: Result = stop.value
            failed = ', '.join(check.name for check in result.checks if not check.passed)
            self._finish(not failed, f'failed: {failed}' if failed else '', result)
        except ProcedureFailed as failure:
            result = Result(self.reading, failure.attempts)
            self._finish(False, str(failure), result)

    def _stand_still(self, why: str) -> None:
        """End whatever is under way, after a tick that could not be made."""
        self.base.state = BaseState()
        self.substrate_speed = 0.0
        self.transducer.release()
        self.forget()
        if self._running:
            self._running.steps.close()
            self.statistics.count(self._end(False, why, Result(None)))

    def _finish(self, success: bool, error: str, result: Result) -> None:
        """Let the running procedure end, well or not, with no cell held and no set-point left.

        But a read leaves a strain that was set by hand.
        """
        outcome = self._end(success, error, result)
        self.statistics.count(outcome)
        self.transducer.release()
        if outcome.procedure != 'read' and self.actuator.motion.target != 0.0:
            self.actuator.ramp_to(0.0, self.settings.erase.release)

    def _end(self, success: bool, error: str, result: Result) -> Outcome:
        assert self._running is not None
        run, self._running = self._running, None
        outcome = Outcome(
            run.name,
            success,
            error,
            result.reading,
            result.attempts,
            run.start_tick,
            self.ticks,
            result.checks,
            result.delays,
        )
        self._events.append(outcome)
        return outcome


class _Run:
    """A procedure under way."""

    def __init__(self, name: str, steps: Procedure[Any], start_tick: int) -> None:
        self.name = name
        self.steps = steps
        self.start_tick = start_tick
