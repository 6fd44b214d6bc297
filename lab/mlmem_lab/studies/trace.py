# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A device or a chain observed while it works, for the x-t figures; and a climb: every level is
written and read back, and compared with the true wall.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from mlmem import Command, MemoryElement, Outcome, Write
from mlmem.instrument.motion import Cycle, Ramp
from mlmem.physics import Chain, Design, find_level, find_walls, substep_times
from mlmem.physics.potential import Array


@dataclass
class Trace:
    """Observations at the end of every tick.

    Attributes:
        t: Times in time units.
        strain: Strain of the substrate.
        configuration: Delta_j, one row of N each.
        outcomes: How every procedure ended, in order.
    """

    t: list[float] = field(default_factory=list)
    strain: list[float] = field(default_factory=list)
    configuration: list[Array] = field(default_factory=list)
    outcomes: list[Outcome] = field(default_factory=list)


def record_procedure(element: MemoryElement, command: Command, trace: Trace) -> Outcome:
    """Apply a command, advance until its procedure has ended, and record every tick.

    Args:
        command: A command that starts a procedure.
        trace: Observations are appended to it.

    Returns:
        How the procedure ended.
    """
    element.apply(command)
    while True:
        events = element.advance()
        trace.t.append(element.ticks * element.tick)
        trace.strain.append(element.actuator.strain)
        trace.configuration.append(element.chain.configuration)
        for event in events:
            if isinstance(event, Outcome):
                trace.outcomes.append(event)
                return event


def strain_chain(chain: Chain, cycle: Cycle, every: float) -> Trace:
    """Strain a bare chain through smooth ramps, and sample it at intervals.

    Its ramps begin at the current strain; `every` is the longest time between samples.

    Returns:
        The observations, one entry per sample; the clock starts at zero.
    """
    design, trace = chain.design, Trace()
    scale = design.end_displacement(1.0)
    clock = 0.0
    for leg in cycle.motions:
        looks = math.ceil(leg.duration / every)
        steps = round(leg.duration / max(1, looks) / chain.dt)
        span = steps * chain.dt
        motion = Ramp(chain.V_N / scale, leg.target, looks * span)
        times = substep_times(steps, chain.dt, chain.integrator)
        for look in range(looks):
            strain = motion.strain(look * span + times)
            chain.advance(strain * scale)
            clock += span
            trace.t.append(clock)
            trace.strain.append(float(strain[-1]))
            trace.configuration.append(chain.configuration)
    return trace


def wall_position(design: Design, configuration: Array) -> float:
    """Return the position of the only wall of a configuration; NaN for none or several."""
    found = find_walls(design, configuration)
    return found[0].position if len(found) == 1 else float('nan')


def wall_path(design: Design, configurations: list[Array]) -> Array:
    """Return the wall's position in each of m configurations, shape (m,), NaN for none."""
    return np.array([wall_position(design, configuration) for configuration in configurations])


@dataclass(frozen=True)
class WrittenLevel:
    """One write, verified by its echo, and the truth.

    Attributes:
        outcome: How the write ended, with its reading.
        level: Level at whose defect the wall really is; -1 blank; -2 none of them.
        wall: Its position in sites, NaN for none or several.
    """

    asked: int
    outcome: Outcome
    level: int
    wall: float

    @property
    def failure(self) -> str:
        """Why it failed.

        Returns:
            '' if the level was written and read back; 'wall' if the wall is elsewhere and the
            device knows that its write failed; 'silent' if it does not know; 'echo' if the wall is
            right and the reading is not.
        """
        if self.level != self.asked:
            return 'silent' if self.outcome.success else 'wall'
        return '' if self.outcome.success else 'echo'


@dataclass(frozen=True)
class Climb:
    """Levels written one after another, up to the first that failed."""

    writes: tuple[WrittenLevel, ...]
    levels: int

    @property
    def reached(self) -> int:
        """How many levels were written and read back."""
        return sum(not each.failure for each in self.writes)

    @property
    def passed(self) -> bool:
        """Whether all of them were."""
        return self.reached == self.levels

    @property
    def failure(self) -> str:
        """Why the last write failed, '' where all passed (see `WrittenLevel.failure`)."""
        return self.writes[-1].failure


def write_upward(
    element: MemoryElement,
    level: Callable[[MemoryElement], int] | None = None,
    contents: Sequence[int] = (),
) -> Climb:
    """Write every level from 0 up with one attempt each; stop at the first failure.

    Every write is the node's: it launches or drives the wall, probes it and decodes the echo. A
    level counts if the echo decodes to it and the wall is really there.

    Args:
        element: An element at rest; it is advanced.
        level: Returns the true level; by default the one within a cell of the wall.
        contents: What to write instead.
    """
    assert element.settings.write.attempts == 1
    design, writes = element.design, []
    contents = contents or range(design.levels)
    for asked in contents:
        outcome = element.perform(Write(asked))
        found = element.chain.configuration
        true = find_level(design, found) if level is None else level(element)
        writes.append(WrittenLevel(asked, outcome, true, wall_position(design, found)))
        if writes[-1].failure:
            break
    return Climb(tuple(writes), len(contents))


def least_margins(outcomes: Iterable[Outcome]) -> dict[str, float | None]:
    """Return the least margins of all readings, by name; None without a finite one."""
    readings = [outcome.reading for outcome in outcomes if outcome.reading]
    return {
        name: min(filter(math.isfinite, (getattr(each, name) for each in readings)), default=None)
        for name in ('level_margin', 'threshold_margin')
    }
