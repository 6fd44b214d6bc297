# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A material with its actuator, linkage, base and transducers, and one tick of it.

It knows no command and no level: procedures play on it, and `MemoryElement` runs them.
"""

from __future__ import annotations

import math

import numpy as np

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
from .actuator import Actuator
from .base import Base, BaseState
from .end import End
from .errors import Refused, SettingsError
from .faults import HEALTHY, Faults, worn
from .linkage import Linkage
from .material import Material
from .reading import phase_of
from .sensor_faults import sensed
from .settings import Settings, TimeSettings
from .transducer import Transducer
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


LONGEST_RUN = 50
"""Ticks that are worth to be made in one run: their strain fits a cache."""

EARLY = 1e-6
"""Ticks by which a look comes too early rather than too late, as clocks round."""


class Instrument:
    """What strains an element and listens to its ends, tick by tick.

    Attributes:
        design: The element.
        settings: The instrument's settings.
        material: What is strained and listened to.
        actuator: Tells the strain of the substrate.
        linkage: Brings that strain to the substrate.
        base: What the element stands on.
        faults: What is wrong.
        transducer: Drives and senses the ends.
        ticks: Ticks since the instrument was made: its clock.
        tick: Length of a tick in time units.
        steps_per_tick: Samples of a tick.
        substrate_speed: Mean speed of the substrate's end in the last tick.
    """

    def __init__(self, design: Design, settings: Settings) -> None:
        """Put a blank chain at rest into an instrument.

        Args:
            design: The element.
            settings: The instrument's settings.

        Raises:
            SettingsError: It would have to take too many steps or samples.
            DesignError: The step is beyond the stability limit.
        """
        self.design = design
        self.settings = settings
        self.tick = settings.time.tick
        self.steps_per_tick = steps_per_tick(design, settings.time)
        integrator = INTEGRATORS[settings.time.integrator]
        self.material: Material = Chain(design, self.tick / self.steps_per_tick, integrator)
        self.actuator = Actuator(settings.actuator)
        self.linkage = Linkage(settings.actuator.max_rate)
        self.base = Base(settings.disturbance, self.tick, design.holding_force)
        self.faults = HEALTHY
        self.transducer = Transducer(design, settings, self.material)
        self.ticks = 0
        self.substrate_speed = 0.0
        self._times = substep_times(self.steps_per_tick, self.material.dt, integrator)
        self._substeps = np.diff(self._times, prepend=0.0)
        self._progress = self._times / self.tick

    @property
    def chain(self) -> Chain:
        """The simulated material, for those who may look inside: no procedure does."""
        assert isinstance(self.material, Chain)
        return self.material

    @property
    def units(self) -> Units:
        """What its units are in SI."""
        return Units(self.design, self.settings.scale)

    @property
    def resting(self) -> bool:
        """Whether nothing is under way: strain and base stand still."""
        return not self.actuator.moving and self.base.still

    @property
    def steady(self) -> bool:
        """Whether it is known what the next ticks bring: no fault, and the base stands still."""
        return self.base.still and self.linkage.state.true and self.faults == HEALTHY

    def next_look(self, left: float) -> int:
        """Return after how many ticks to look again at what takes a time yet: never too late."""
        return max(1, math.floor(left / self.tick - EARLY) + 1)

    def phase(self, end: End) -> int | None:
        """Return the phase an end rests in: 0 inactive, 1 active, None in between."""
        substrate = end.displacement(self.design, self.linkage.encoder)
        return phase_of(self.design, self.transducer.rest(end) - substrate)

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

    def pass_ticks(self, ticks: int = 1) -> None:
        """Let ticks pass; while the instrument is `steady` the material is asked once for all.

        The bits are those of the ticks one by one.

        Raises:
            StateError: The material cannot go on (see `Chain.advance`). It is as it was before
                the tick in which it could not, and strain and base stand still.
        """
        if ticks > 1 and self.steady:
            try:
                self._pass(ticks)
            except StateError:
                pass  # one by one they tell in which tick
            else:
                return
        for _ in range(ticks):
            try:
                self._pass(1)
            except StateError as error:
                self.actuator.hold(self.actuator.strain)
                self.stand_still(str(error))
                raise

    def _pass(self, ticks: int) -> None:
        """Let ticks pass in one run; nothing is changed where it raises `StateError`."""
        actuator, linkage, transducer = self.actuator, self.linkage, self.transducer
        before = actuator.state, linkage.state, transducer.held, self.base.state
        shake = self.base.advance(self._progress)
        told = actuator.advance(self._times, ticks)
        strain = linkage.advance(told, self._substeps, self.faults, self.ticks)
        drive = transducer.drive(ticks * self.steps_per_tick)
        V_N = strain * self.design.end_displacement(1.0)
        start = self.material.V_N if ticks == 1 else V_N[-len(self._times) - 1]
        try:
            ends = self.material.advance(V_N, drive, shake, ticks)
        except StateError:
            actuator.state, linkage.state, transducer.held, self.base.state = before
            raise
        self.substrate_speed = (float(V_N[-1]) - float(start)) / self.tick
        last = transducer.recent[:, -1]
        transducer.record(sensed(ends, last, self.faults, self.ticks), ticks)
        self.ticks += ticks

    def stand_still(self, why: str) -> None:
        """End whatever is under way, after a tick that could not be made."""
        self.base.state = BaseState()
        self.substrate_speed = 0.0
        self.transducer.release()
