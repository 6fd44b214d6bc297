# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Strain cycles on the bare chain: no probe and no ticks, so that each takes milliseconds."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Sequence

from mlmem.instrument.motion import Cycle
from mlmem.move_settings import WriteSettings, select_peak
from mlmem.moves.corrections import PulseCorrection, correct_write
from mlmem.physics import (
    NOH_BATHE,
    Chain,
    Design,
    Specimen,
    StateError,
    find_level,
    find_walls,
    stable_step,
    substep_times,
)
from mlmem.physics.equilibrium import find_pinned_wall
from mlmem.physics.potential import Array
from mlmem.readers.reading import BLANK, UNDECODABLE

TIME_STEP = 0.5
"""Time step; the wall's own motion is a hundred times slower."""

COARSE_TIME_STEP = 1.0
"""Time step of checks and searches: with it, all shipped elements get the same verdicts."""

SETTLING_TIME = 2500.0
"""Ten damping times, after which a wall no longer swings about its defect."""


def play_cycle(chain: Chain, cycle: Cycle) -> None:
    """Strain a chain by a cycle.

    Raises:
        StateError: The chain is driven so hard that it diverges.
    """
    times = substep_times(round(cycle.duration / chain.dt), chain.dt, chain.integrator)
    chain.advance(cycle.strain(times) * chain.design.end_displacement(1.0))


def find_level_after(design: Design, cycle: Cycle, level: int, *, dt: float = TIME_STEP) -> int:
    """Return the level after a cycle and a rest, `BLANK`, or `UNDECODABLE` for anything else.

    For the arguments see `find_configuration_after`.
    """
    after = find_configuration_after(Specimen(design), cycle, level, dt=dt)
    return UNDECODABLE if after is None else find_level(design, after)


def find_configuration_after(
    specimen: Specimen, cycle: Cycle, level: int, *, dt: float = TIME_STEP
) -> Array | None:
    """Return the configuration, shape (N,), after a cycle from a level, or `BLANK`, and a rest, in
    steps of `dt` where they are stable; None if the chain diverges, or no wall rests at the level.
    """
    chain = Chain(specimen.design, min(dt, 0.95 * stable_step(specimen, NOH_BATHE)), NOH_BATHE)
    chain.set_specimen(specimen)
    try:
        if level != BLANK:
            chain.place(find_pinned_wall(specimen, level))
        play_cycle(chain, cycle)
        chain.rest(round(SETTLING_TIME / chain.dt))
    except StateError:
        return None
    return chain.configuration


def scale_peaks(write: WriteSettings, compression: float, tension: float) -> WriteSettings:
    """Return the settings with the peaks multiplied by factors."""
    return dataclasses.replace(
        write, compression=compression * write.compression, tension=tension * write.tension
    )


def measure_departures(
    made: Design | Specimen,
    write: WriteSettings,
    start: int,
    goal: int,
    *,
    max_rate: float = math.inf,
    dt: float = TIME_STEP,
    corrections: Sequence[PulseCorrection] = (),
) -> Iterator[float]:
    """Yield, for every step up from one level to another, how far the wall is from its defect.

    The cycles follow each other as in a write of the device, which rests `write.final_settle`
    longer after the last; then the true wall is measured. Each step starts from the state after
    the previous cycle, before that rest. A write may end where the wall is within a cell.

    Args:
        write: Its cycles.
        start: The level at which the wall starts.
        goal: The level of the last step.
        max_rate: Of the actuator, in strain per time unit.
        dt: Time step, where it is stable.
        corrections: Factors on its cycles, by the level to which they go; none: 1.

    Yields:
        The distance in cells; infinity unless exactly one wall is at rest in the element.

    Raises:
        StateError: The level to start from pins no wall.
    """
    made = Specimen.of(made)
    design = made.design
    chain = Chain(design, min(dt, stable_step(made, NOH_BATHE)), NOH_BATHE)
    chain.set_specimen(made)
    chain.place(find_pinned_wall(made, start))
    for level in range(start, goal):
        own = correct_write(write, corrections[level + 1]) if corrections else write
        cycle = Cycle.plan_cycle(
            own, select_peak(own, design.is_freed_by_compression(level)), max_rate
        )
        try:
            play_cycle(chain, cycle)
            state = chain.state()
            chain.rest(round(write.final_settle / chain.dt))
        except StateError:  # driven so hard that the chain diverges
            yield from [math.inf] * (goal - level)
            return
        found = find_walls(design, chain.configuration)
        alone = find_level(design, chain.configuration, math.inf) >= 0
        yield abs(found[0].position - design.defect_site(level + 1)) if alone else math.inf
        chain.restore(state, V_N=0.0, steps_done=0)
