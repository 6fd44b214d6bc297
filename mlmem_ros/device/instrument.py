# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A driver with its actuator, linkage, base and transducers, advanced tick by tick.

It knows neither commands nor levels: procedures act on it, and `MemoryElement` runs them.
"""

from __future__ import annotations

import math

import numpy as np

from ..physics import Chain, Design, DesignError, Specimen, StateError, substep_times
from ..physics.potential import Array
from .actuator import Actuator
from .base import Base, BaseState
from .driver import Driver
from .end import End
from .errors import DriverError, Refused, SettingsError
from .faults import HEALTHY, Faults, sensed, worn
from .linkage import Linkage
from .progress import Progress
from .reading import phase_of
from .settings import Settings
from .simulation import Simulation
from .transducer import Transducer
from .units import Units

LONGEST_RUN = 50
"""Most ticks of a run: their strains fit into a cache."""

FARTHEST = 1e6
"""Largest possible end displacement in cells."""

EARLY = 1e-6
"""Tolerance in ticks against rounding of the clock: rather early than late."""


class Instrument:
    """Strains an element and listens to its ends, tick by tick.

    Attributes:
        design: The element.
        settings: The instrument's settings.
        driver: Strains and measures the element, simulated or real.
        actuator: Sets the strain of the substrate.
        linkage: Brings that strain to the substrate.
        base: What carries the element.
        faults: The present faults.
        transducer: Drives and senses the ends.
        ticks: Ticks done: its clock.
        tick: Length of a tick in time units.
        steps_per_tick: Samples of a tick.
        substrate_speed: Mean speed of the substrate's end in the last tick.
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
        self.settings = settings
        self.tick = settings.time.tick
        self.driver = driver or Simulation.of(design, settings.time)
        self.steps_per_tick = _samples(self.tick, self.driver.dt)
        self.actuator = Actuator(settings.actuator)
        self.linkage = Linkage(settings.actuator)
        self.base = Base(settings.disturbance, self.tick, design.holding_force)
        self.faults = HEALTHY
        self.transducer = Transducer(design, settings, self.driver)
        self.ticks = 0
        self.substrate_speed = 0.0
        self.progress = Progress()
        self._times = substep_times(self.steps_per_tick, self.driver.dt, self.driver)
        self._substeps = np.diff(self._times, prepend=0.0)
        self._progress = self._times / self.tick

    @property
    def chain(self) -> Chain:
        """The simulated material. Procedures must not use it.

        Raises:
            Refused: The element is real.
        """
        if (chain := self.driver.chain) is None:
            raise Refused('only a simulated element has a chain')
        return chain

    @property
    def simulated(self) -> bool:
        """Whether there is a `chain`."""
        return self.driver.chain is not None

    @property
    def units(self) -> Units:
        """The units in SI."""
        return Units(self.design, self.settings.scale)

    @property
    def resting(self) -> bool:
        """Whether strain and base stand still."""
        return not self.actuator.moving and self.base.still

    @property
    def steady(self) -> bool:
        """Whether the strain and the samples are free of faults."""
        return self.linkage.state.true and self.faults == HEALTHY

    def next_look(self, left: float) -> int:
        """Return after how many ticks to check something that takes this long; never too many."""
        return max(1, math.floor(left / self.tick - EARLY) + 1)

    def phase(self, end: End) -> int | None:
        """Return the phase an end rests in: 0 inactive, 1 active, None in between."""
        substrate = end.displacement(self.design, self.linkage.encoder)
        return phase_of(self.design, self.transducer.rest(end) - substrate)

    def specimen(self, faults: Faults) -> Specimen:
        """Return the material with faults; any thread may call it.

        Raises:
            Refused: The design has no such cell, the step is too long for this material, or the
                element is real.
        """
        if not self.simulated and (wrong := faults.of_the_material()):
            raise Refused(f'faults: {", ".join(wrong)} apply only to a simulated element')
        try:
            specimen = worn(self.design, faults)
            if self.simulated:
                self.chain.check(specimen)
        except (SettingsError, DesignError) as error:
            raise Refused(f'faults: {error}') from error
        return specimen

    def suffer(self, faults: Faults) -> None:
        """Replace all faults by these; raises as `specimen` does, with nothing changed."""
        specimen = self.specimen(faults)
        if self.simulated:
            self.chain.become(specimen)
        self.faults = faults

    def pass_ticks(self, ticks: int = 1) -> None:
        """Let ticks pass; while the instrument is `steady`, in one call of the driver.

        The results have the same bits as tick by tick.

        Raises:
            StateError: The material cannot continue (see `Chain.advance`). It is as before the
                failing tick, and strain and base stand still.
            DriverError: The element cannot be reached, or its driver returns impossible values.
        """
        try:
            if ticks > 1 and self.steady:
                try:
                    self._pass(ticks)
                except StateError:
                    pass  # tick by tick shows which one fails
                else:
                    return
            for _ in range(ticks):
                self._pass(1)
        except (StateError, DriverError) as error:
            self.actuator.hold(self.actuator.strain)
            self.stand_still(str(error))
            raise

    def _pass(self, ticks: int) -> None:
        """Let ticks pass in one run; on `StateError` nothing is changed."""
        actuator, linkage, transducer = self.actuator, self.linkage, self.transducer
        before = actuator.state, linkage.state, transducer.held, self.base.state
        shake = self.base.advance(self._progress, ticks)
        told = actuator.advance(self._times, ticks)
        strain = linkage.advance(told, self._substeps, self.faults, self.ticks)
        drive = transducer.drive(ticks * self.steps_per_tick)
        V_N = strain * self.design.end_displacement(1.0)
        start = self.driver.V_N if ticks == 1 else V_N[-len(self._times) - 1]
        try:
            ends = self.driver.advance(V_N, drive, shake, ticks)
        except OSError as error:
            raise DriverError(f'the driver failed: {error}') from error
        except StateError:
            actuator.state, linkage.state, transducer.held, self.base.state = before
            raise
        if not self.simulated:
            _check(ends, ticks * self.steps_per_tick)
        self.substrate_speed = (float(V_N[-1]) - float(start)) / self.tick
        last = transducer.recent[:, -1]
        heard = sensed(ends, last, self.faults, self.ticks)
        transducer.record(heard, ticks, self.driver.interrupted)
        self.ticks += ticks

    def stand_still(self, why: str) -> None:
        """End everything under way after a failed tick."""
        self.base.state = BaseState()
        self.substrate_speed = 0.0
        self.transducer.release()


def _samples(tick: float, dt: float) -> int:
    """Return how many samples a tick has."""
    samples = max(1, round(tick / dt))
    if not math.isclose(samples * dt, tick, rel_tol=1e-9):
        raise SettingsError(
            f'time.tick must be a whole number of samples, which are {dt:.6g} apart; got {tick:g}'
        )
    return samples


def _check(ends: Array, samples: int) -> None:
    """Raise `DriverError` for impossible samples of a real element."""
    if np.shape(ends) != (2, samples):
        raise DriverError(
            f'the driver must return {samples} samples of both ends; got shape {np.shape(ends)}'
        )
    if not (np.abs(ends) <= FARTHEST).all():  # false for NaN, too
        raise DriverError(
            f'the driver must return displacements of at most {FARTHEST:g} cells; got more, or NaN'
        )
