# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Steps of a write on the bare chain: no probe and no ticks, so that each takes milliseconds."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator

from ..device.motion import Cycle
from ..device.settings import WriteSettings, peak
from ..physics import (
    Chain,
    Design,
    Specimen,
    StateError,
    level_of,
    stable_step,
    substep_times,
    walls,
)
from ..physics.equilibrium import resting_wall
from ..physics.potential import Array

STEP = 0.5
"""Time step; the wall's own motion is a hundred times slower."""


def scaled(write: WriteSettings, compression: float, tension: float) -> WriteSettings:
    """Return the settings with the peaks multiplied by factors."""
    return dataclasses.replace(
        write, compression=compression * write.compression, tension=tension * write.tension
    )


def steps_up(
    design: Design,
    write: WriteSettings,
    start: int,
    goal: int,
    *,
    max_rate: float = math.inf,
    dt: float = STEP,
) -> Iterator[bool]:
    """Yield, for every step up from one level to another, whether a write may end there.

    The true wall has to be within a cell of its defect; see `departures`.
    """
    for away in departures(design, write, start, goal, max_rate=max_rate, dt=dt):
        yield away < 1.0


def departures(
    design: Design,
    write: WriteSettings,
    start: int,
    goal: int,
    *,
    max_rate: float = math.inf,
    dt: float = STEP,
) -> Iterator[float]:
    """Yield, for every step up from one level to another, how far the wall is from its defect.

    The cycles follow each other as in a write of the device, which rests `write.final_settle`
    longer after the last; then the true wall is measured. Each step starts from the state after
    the previous cycle, before that rest.

    Args:
        design: The element.
        write: Its cycles.
        start: The level at which the wall starts.
        goal: The level of the last step.
        max_rate: Of the actuator, in strain per time unit.
        dt: Time step, where it is stable.

    Yields:
        The distance in cells; infinity unless exactly one wall is at rest in the element.

    Raises:
        StateError: The level to start from pins no wall.
    """
    chain = Chain(design, min(dt, stable_step(Specimen(design))))
    chain.place(resting_wall(Specimen(design), start))
    cycles = {
        compress: Cycle.planned(write, peak(write, compress), max_rate)
        for compress in (True, False)
    }
    for level in range(start, goal):
        try:
            _advance(chain, cycles[design.freed_by_compression(level)])
            state = chain.state()
            chain.rest(round(write.final_settle / chain.dt))
            yield _departure(design, chain.configuration, level + 1)
        except StateError:  # driven so hard that the chain diverges
            yield from [math.inf] * (goal - level)
            return
        chain.restore(state, V_N=0.0, steps_done=0)


def _departure(design: Design, configuration: Array, level: int) -> float:
    if level_of(design, configuration, math.inf) < 0:
        return math.inf
    (wall,) = walls(design, configuration)
    return abs(wall.position - design.defect(level))


def _advance(chain: Chain, cycle: Cycle) -> None:
    steps = round(cycle.duration / chain.dt)
    times = substep_times(steps, chain.dt, chain.integrator)
    chain.advance(cycle.strain(times) * chain.design.end_displacement(1.0))
