# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The blocks of which procedures are made: waits, strains, and moves of the boundary cells."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from dataclasses import dataclass, field
from typing import TypeVar

from ..end import End
from ..errors import ProcedureFailed
from ..events import Check
from ..instrument import LONGEST_RUN, Instrument
from ..memory import Memory
from ..motion import Cycle
from ..progress import LAUNCHING, SETTLING, STRAINING
from ..reading import Reading
from ..settings import EraseSettings, WriteSettings

T = TypeVar('T')
Procedure = Generator[int, None, T]
"""Yields after how many ticks it wants to go on: it decides nothing before, and may be asked."""

BRING_BACK_SPEED = 0.2
"""Speed at which an end in a third ground state is moved back; 0.1 to 0.4 was seen to work."""


FOLLOWING_ERROR = 0.1
"""Share of the greatest strain by which the actuator may be beside its set-point."""


@dataclass(frozen=True)
class Result:
    """What a procedure leaves: its last reading, its tries, what it tested and learnt."""

    reading: Reading | None
    attempts: int = 1
    checks: tuple[Check, ...] = ()
    delays: dict[str, tuple[float, ...]] = field(default_factory=dict)


def run(
    instrument: Instrument, procedure: Procedure[T], before: Callable[[], object] | None = None
) -> T:
    """Advance an instrument until a procedure has ended, and return its result.

    Args:
        instrument: What it plays on.
        procedure: What is done.
        before: Called before every tick.

    Raises:
        ProcedureFailed: As by the procedure.
        StateError: The material cannot go on.
    """
    while True:
        try:
            ticks = next(procedure)
        except StopIteration as stop:
            result: T = stop.value
            return result
        if before is not None:
            before()
            ticks = 1
        instrument.pass_ticks(min(ticks, LONGEST_RUN))


def wait(element: Instrument, duration: float) -> Procedure[None]:
    """Let whole ticks pass, at least `duration` time units."""
    if duration > 0.0:
        element.progress.phase = SETTLING
    end = element.ticks + math.ceil(duration / element.tick)
    while element.ticks < end:
        yield end - element.ticks


def catch_up(element: Instrument) -> Procedure[None]:
    """Let ticks pass until the samples of this one are in: a driver may hear late."""
    yield from wait(element, element.driver.lag * element.tick)


def ramp(
    element: Instrument, strain: float, duration: float, delay: float = 0.0
) -> Procedure[None]:
    """Move the strain smoothly and wait until it is there.

    Raises:
        ProcedureFailed: The actuator does not follow, though it was waited for as long again.
    """
    element.progress.phase = STRAINING
    element.actuator.ramp_to(strain, duration, delay)
    while element.actuator.moving:
        yield element.next_look(element.actuator.left)
    allowed = FOLLOWING_ERROR * element.settings.actuator.max_strain
    patience = math.ceil(duration / element.tick)
    while abs((encoder := element.linkage.encoder) - strain) > allowed:
        if patience == 0:
            raise ProcedureFailed(
                f'the actuator does not follow: it stands at a strain of {encoder:.4f} where '
                f'{strain:.4f} is wanted'
            )
        patience -= 1
        yield 1


def play(element: Instrument, cycle: Cycle, delay: float = 0.0) -> Procedure[None]:
    """Strain the element through ramps and waits; see `ramp` and `wait`."""
    for motion in cycle.motions:
        if motion.still and not element.actuator.moving:
            yield from wait(element, motion.duration)
        else:
            yield from ramp(element, motion.target, motion.duration, delay)


def launch(
    element: Instrument, times: WriteSettings | EraseSettings, target: float
) -> Procedure[None]:
    """Under a strain, move v_1 to another ground state at constant speed, and let it go."""
    rise, *rest = Cycle.planned(times, times.start_strain).motions
    yield from play(element, Cycle((rise,)))
    yield from catch_up(element)  # to know where the end is
    element.progress.phase = LAUNCHING
    element.transducer.move(End.LEFT, target, times.launch_speed)
    while element.transducer.driving:
        yield element.next_look(element.transducer.left)
    yield from play(element, Cycle(tuple(rest)))


def bring_back(element: Memory, end: End) -> Procedure[None]:
    """Move an end that strayed into a third ground state back to the active phase.

    A wall that is driven over a free end comes back as one between the active phase and the
    next. No strain moves it, but the wall that this launches does away with it where it is
    within some 90 cells.
    """
    element.forget()
    element.progress.phase = LAUNCHING
    element.transducer.move(end, element.design.D_s2, BRING_BACK_SPEED)
    while element.transducer.driving:
        yield element.next_look(element.transducer.left)
    yield from wait(element, element.settings.erase.settle)
    yield from catch_up(element)


def slacken(element: Memory) -> Procedure[None]:
    """Bring a strain that was set by hand back to zero, and let the element settle.

    By the times of an erase, which is slow: a write may end its way back within a tick.
    """
    if element.actuator.strain != 0.0 or element.actuator.moving:
        element.forget()
        yield from play(element, Cycle.let_go(element.settings.erase, element.actuator.strain))
