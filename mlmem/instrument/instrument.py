# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A driver with its actuator, transmission, base and transducers, advanced tick by tick.

It knows neither commands nor levels: procedures act on it, and `MemoryElement` runs them.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Literal

import numpy as np

from ..errors import Astray, DriverError, ErrorCode, Refused, SettingsError
from ..physics import Chain, Design, DesignError, Specimen, StateError, substep_times
from ..physics.jit import compile_kernel
from ..physics.values import Array
from ..settings import Settings
from .actuator import Actuator, Transmission
from .base import NO_SHAKES, Base, BaseState, Shakes
from .drivers import Driver, Simulation
from .echo import listening_time
from .end import End
from .faults import NO_FAULTS, Faults, Sensors, apply_faults
from .transducer import UNLIMITED_SAMPLES, Transducer

Phase = Literal['', 'waiting', 'quieting', 'straining', 'launching', 'settling', 'listening']
"""Phase of a procedure: waiting while another one runs, empty before its first tick."""


class Progress:
    """The progress of one procedure."""

    def __init__(self, procedure: str = '', tick: int = 0) -> None:
        self.procedure = procedure
        self.phase: Phase = ''
        self.attempts = 1
        self.start_tick = self._end = tick

    def expect_end(self, end: float) -> None:
        """Expect the end at this tick or later.

        A procedure that another one calls ends within the expected time; a further attempt
        prolongs it.
        """
        self._end = max(self._end, round(end))

    def record_attempts(self, procedure: str, attempts: int) -> None:
        """Set the attempts of the procedure itself; those of one that it calls do not count."""
        if procedure == self.procedure:
            self.attempts = attempts

    def find_elapsed_share(self, tick: int) -> float:
        """Return the elapsed share of the expected time, 0 to 1; 1 if it is late."""
        passed = tick - self.start_tick
        return passed / max(self._end - self.start_tick, passed, 1)


class Instrument:
    """Strains an element and listens to its ends, tick by tick.

    Attributes:
        made: What a simulated element is without faults.
        ticks: Ticks done: its clock.
        tick: Length of a tick in time units.
        steps_per_tick: Samples of a tick.
        computed: Tick after which the element rests: nothing but clocks has changed since.
        last_moved: Tick after which substrate, base and material have not moved or changed, and no
            wall was kicked or a register cleared.
        substrate_speed: Mean speed of the substrate's end in the last tick.
        random_since: Tick from which the random numbers of faults are counted.
        progress: Progress of the running procedure.
    """

    def __init__(self, design: Design, settings: Settings, driver: Driver | None = None) -> None:
        """Put an unstrained element into an instrument: by default a simulated one, blank and at
        rest.

        Raises:
            SettingsError: It needs too many steps or samples, or a tick is not a whole number of
                samples.
            DesignError: The step is beyond the stability limit.
        """
        self.design = design
        self.tick = settings.time.tick
        self.driver = driver or Simulation.build_blank(design, settings.time)
        if not self.driver.strains:
            settings = replace(settings, actuator=replace(settings.actuator, present=False))
        self.settings = settings
        self.made = self.chain.specimen if self.is_simulated else Specimen(design)
        self.steps_per_tick = _count_samples(self.tick, self.driver.dt)
        self.actuator = Actuator(settings.actuator)
        self.transmission = Transmission(settings.actuator)
        self.base = Base(settings.disturbance, self.tick, design.holding_force)
        self.faults = NO_FAULTS
        self.random_since = 0
        self.sensors = Sensors(self.driver.dt)
        self.transducer = Transducer(design, settings, self.driver)
        self.ticks = 0
        self.computed = 0
        self.last_moved = -UNLIMITED_SAMPLES
        self.substrate_speed = 0.0
        self.progress = Progress()
        self._times = substep_times(self.steps_per_tick, self.driver.dt, nodes=self.driver.nodes)
        self._substeps = np.diff(self._times, prepend=0.0)
        # a slower end of the substrate, in cells per time unit, excites no waves
        self._excites = 1e-5 * self._substeps
        self._progress = self._times / self.tick

    @property
    def chain(self) -> Chain:
        """The simulated material. Procedures must not use it.

        Raises:
            Refused: The element is real.
        """
        if (chain := self.driver.chain) is None:
            why = 'only a simulated element has a chain'
            raise Refused(ErrorCode.UNSUPPORTED, reason=why)
        return chain

    @property
    def is_simulated(self) -> bool:
        """Whether there is a `chain`."""
        return self.driver.chain is not None

    @property
    def elongation(self) -> float:
        """Displacement of the substrate's end for a strain of 1, in m."""
        return self.settings.scale.length * self.design.end_displacement(1.0)

    @property
    def is_still(self) -> bool:
        """Whether strain and base stand still."""
        return not self.actuator.is_moving and self.base.is_still

    @property
    def at_rest(self) -> bool:
        """Whether ticks change nothing but clocks until something is set."""
        goal = self.actuator.target_strain
        return (
            self.is_still
            and self.transducer.at_rest
            and self.is_faultless
            and goal == self.transmission.state.commanded
            and self.driver.at_rest(goal * self.design.end_displacement(1.0))
            and self.transducer.has_last_displacements
        )

    @property
    def is_faultless(self) -> bool:
        """Whether the strain and the samples are free of faults."""
        return self.transmission.state.is_exact and self.faults.has_only_material_faults

    def expect_duration(self, duration: float) -> None:
        """Expect the running procedure to end after at least this time."""
        self.progress.expect_end(self.ticks + duration / self.tick)

    def passage_time(self, end: End) -> float:
        """Return in which time a pulse of an end comes back from the far end, at the most."""
        return listening_time(self.design, self.transducer.probes[end], end)

    def count_ticks_to_check(self, remaining: float) -> int:
        """Return after how many ticks to check something that takes this long; never too many."""
        # against rounding of the clock: rather a tick early than late
        return max(1, math.floor(remaining / self.tick - 1e-6) + 1)

    def phase(self, end: End) -> int | None:
        """Return the phase an end rests in: 0 inactive, 1 active, None in between."""
        substrate = end.find_displacement(self.design, self.transmission.encoder_strain)
        return find_phase(self.design, self.transducer.measure_rest(end) - substrate)

    @property
    def phases(self) -> tuple[int | None, int | None]:
        """The phases of the left and of the right end."""
        return self.phase(End.LEFT), self.phase(End.RIGHT)

    def require_phase(self, end: End) -> None:
        """Make sure that an end rests where a pulse about its rest begins without a jump.

        Raises:
            Astray: It does not, or a transducer shows it elsewhere.
        """
        rest = self.transducer.measure_rest(end) - end.find_displacement(
            self.design, self.transmission.encoder_strain
        )
        # At the left a strain moves the rest by 0.06 of the distance of ground states, and a
        # pulse that begins with a jump of 0.13 takes a wall away. The right end follows the
        # substrate, whose strain may have an offset that the encoder does not measure.
        tolerances = (0.1,) if end is End.LEFT else ()
        if find_phase(self.design, rest, *tolerances) is None:
            raise Astray(
                f'the {end} end rests in neither phase, at {rest:.2f} cells: no pulse is fired '
                'there, which would begin with a jump'
            )

    def specimen(self, faults: Faults) -> Specimen:
        """Return the material with faults; any thread may call it.

        Raises:
            Refused: The design has no such cell, the step is too long for this material, or the
                element is real.
        """
        if not self.is_simulated and (wrong := faults.list_material_faults()):
            name = next(iter(wrong))
            expected = 'left out for a real element, whose material has its own faults'
            value = getattr(faults, name)
            raise Refused(ErrorCode.UNSUPPORTED, f'faults.{name}', value, expected)
        try:
            specimen = apply_faults(self.made, faults)
            if (chain := self.driver.chain) is not None:
                chain.check(specimen)
        except SettingsError as error:
            raise Refused.of_error(error, 'faults') from error
        except DesignError as error:  # its field is one of the material, which the faults make
            raise Refused(error.code, 'faults', faults, reason=str(error)) from error
        return specimen

    def set_faults(self, faults: Faults) -> None:
        """Replace all faults by these; raises as `specimen` does, with nothing changed."""
        specimen = self.specimen(faults)
        if self.is_simulated:
            self.chain.set_specimen(specimen)
            self.last_moved = self.ticks
        self.sensors.change_faults(faults)
        self.faults = faults

    def restart_random_numbers(self, seed: int) -> None:
        """Let the random numbers of all faults begin anew from a seed.

        Raises:
            Refused: As `specimen` does for the faults with this seed; nothing is changed.
        """
        self.set_faults(replace(self.faults, seed=seed))
        self.sensors = Sensors(self.driver.dt)
        self.random_since = self.ticks

    def pass_ticks(self, ticks: int = 1, shakes: Shakes = NO_SHAKES) -> None:
        """Let ticks pass, with accelerations as for `Base.advance`; while it `is_faultless`, in
        one call of the driver.

        The results have the same bits as tick by tick.

        Raises:
            StateError: The material cannot continue (see `Chain.advance`). It is as before the
                failing tick, and strain and base stand still.
            DriverError: The element cannot be reached, or its driver returns impossible values.
        """
        if not shakes and self.at_rest:
            self.driver.pass_by(ticks * self.steps_per_tick)
            self.transducer.pass_by(self.steps_per_tick, ticks)
            self.ticks += ticks
            self.substrate_speed = 0.0
            return
        try:
            if ticks > 1 and self.is_faultless:
                try:
                    self._advance_run(ticks, shakes)
                except StateError:
                    pass  # tick by tick shows which one fails
                else:
                    return
            for tick in range(ticks):
                self._advance_run(1, {0: shakes[tick]} if tick in shakes else NO_SHAKES)
        except (StateError, DriverError) as error:
            self.actuator.hold(self.actuator.strain)
            self.stop_after_failure(str(error))
            raise

    def _advance_run(self, ticks: int, shakes: Shakes) -> None:
        """Let ticks pass in one run; on `StateError` nothing is changed."""
        actuator, transmission, transducer = self.actuator, self.transmission, self.transducer
        before = actuator.state, transmission.state, transducer.held, self.base.state
        shake = self.base.advance(self._progress, ticks, shakes)
        commanded = actuator.advance(self._times, ticks)
        random_tick = self.ticks - self.random_since
        strain = transmission.advance(commanded, self._substeps, self.faults, random_tick)
        held_cell = transducer.held_cell(ticks * self.steps_per_tick, self.faults)
        V_N = strain * self.design.end_displacement(1.0)
        start = self.driver.V_N
        try:
            ends = self.driver.advance(V_N, held_cell, shake, ticks)
        except OSError as error:
            raise DriverError(f'the driver failed: {error}') from error
        except StateError:
            actuator.state, transmission.state, transducer.held, self.base.state = before
            raise
        if not self.is_simulated:
            _check_samples(ends, ticks * self.steps_per_tick)
        before_last = start if ticks == 1 else V_N[-len(self._times) - 1]
        self.substrate_speed = (float(V_N[-1]) - float(before_last)) / self.tick
        shaken = 0 if shake is None else len(np.trim_zeros(shake, 'b'))
        strained = before[1].strain * self.design.end_displacement(1.0)
        if moved := max(_find_last_motion(V_N, strained, self._excites), shaken):
            self.last_moved = self.ticks + math.ceil(moved / len(self._times))
        last = transducer.recent[:, -1]
        samples = self.sensors.apply_sensor_faults(ends, last, self.faults, random_tick)
        transducer.record(samples, ticks, self.driver.interrupted)
        self.ticks += ticks
        self.computed = self.ticks

    def stop_after_failure(self, why: str) -> None:
        """End everything under way after a failed tick."""
        self.base.state = BaseState()
        self.substrate_speed = 0.0
        self.transducer.release_ends()


def find_phase(design: Design, rest: float, tolerance: float = 0.25) -> int | None:
    """Return the phase of an end: 0 inactive, 1 active, None in between.

    Args:
        design: The element.
        rest: Rest displacement of the end minus that of the substrate under it, in cells.
        tolerance: Largest offset of `rest` from a ground state, as a fraction of their distance.
    """
    active = (rest - design.D_s1) / (design.D_s2 - design.D_s1)
    phase = round(active)
    return phase if phase in (0, 1) and abs(active - phase) <= tolerance else None


@compile_kernel
def _find_last_motion(V_N: Array, start: float, excites: Array) -> int:
    """Return how many values there are up to the last towards which the substrate moves.

    A lagging actuator approaches its set-point for ever; what excites no waves does not count.
    """
    for k in range(len(V_N) - 1, -1, -1):
        before = V_N[k - 1] if k else start
        if abs(V_N[k] - before) > excites[k % len(excites)]:
            return k + 1
    return 0


def _count_samples(tick: float, dt: float) -> int:
    """Return how many samples a tick has."""
    samples = max(1, round(tick / dt))
    if not math.isclose(samples * dt, tick, rel_tol=1e-9):
        raise SettingsError(
            ErrorCode.CONFLICT, 'time.tick', tick,
            f'a whole number of samples, which are {dt:.6g} apart',
        )  # fmt: skip
    return samples


def _check_samples(ends: Array, samples: int) -> None:
    """Raise `DriverError` for impossible samples of a real element."""
    if np.shape(ends) != (2, samples):
        raise DriverError(
            f'the driver must return {samples} samples of both ends; got shape {np.shape(ends)}'
        )
    if not (np.abs(ends) <= 1e6).all():  # false for NaN, too
        raise DriverError(
            'the driver must return displacements of at most 1e6 cells; got more, or NaN'
        )
