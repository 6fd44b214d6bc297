# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Building blocks of procedures: waits, and motions of the strain."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from typing import TYPE_CHECKING, TypeVar

from ..errors import NotFollowed
from .motion import Cycle

if TYPE_CHECKING:
    from .end import BoundaryMotion, End
    from .instrument import Instrument

MAX_RUN_TICKS = 50
"""Most ticks of a run: their strains fit into a cache."""

T = TypeVar('T')
Procedure = Generator[int, None, T]
"""Yields the number of ticks after which to resume it; an earlier resumption changes nothing."""


def run(
    instrument: Instrument, procedure: Procedure[T], before: Callable[[], object] | None = None
) -> T:
    """Advance an instrument until a procedure has ended, and return its result.

    If given, `before` is called before every tick.

    Raises:
        ProcedureFailed: The procedure failed.
        StateError: The material cannot continue.
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
        instrument.pass_ticks(min(ticks, MAX_RUN_TICKS))


def wait(element: Instrument, duration: float) -> Procedure[None]:
    """Let whole ticks pass, at least `duration` time units."""
    if duration > 0.0:
        element.progress.phase = 'settling'
    yield from pass_ticks(element, math.ceil(duration / element.tick))


def pass_ticks(element: Instrument, ticks: int) -> Procedure[None]:
    """Let so many ticks pass."""
    end = element.ticks + ticks
    while element.ticks < end:
        yield end - element.ticks


def wait_for_strain(element: Instrument) -> Procedure[None]:
    """Wait while the strain changes."""
    while element.actuator.is_moving:
        yield element.count_ticks_to_check(element.actuator.remaining_time)


def catch_up(element: Instrument) -> Procedure[None]:
    """Wait until the samples of this tick have arrived, because a driver may lag."""
    yield from wait(element, element.driver.lag * element.tick)


def ramp_strain(
    element: Instrument, strain: float, duration: float, delay: float = 0.0
) -> Procedure[None]:
    """Move the strain smoothly and wait until it arrives.

    Raises:
        NotFollowed: The actuator does not follow, even in twice the time.
    """
    element.progress.phase = 'straining'
    element.actuator.ramp_to(strain, duration, delay)
    yield from wait_for_strain(element)
    # the actuator may be off by a tenth of its largest strain
    allowed = 0.1 * element.settings.actuator.max_strain
    ticks_left = math.ceil(duration / element.tick)
    while abs((encoder := element.transmission.encoder_strain) - strain) > allowed:
        if ticks_left == 0:
            raise NotFollowed(
                f'the actuator does not follow: it is at a strain of {encoder:.4f} instead of '
                f'{strain:.4f}'
            )
        ticks_left -= 1
        yield 1


def follow_ramps(element: Instrument, cycle: Cycle, delay: float = 0.0) -> Procedure[None]:
    """Strain the element through ramps and waits; see `ramp` and `wait`."""
    for motion in cycle.motions:
        if motion.is_wait and not element.actuator.is_moving:
            yield from wait(element, motion.duration)
        else:
            yield from ramp_strain(element, motion.target, motion.duration, delay)


def move_end(element: Instrument, end: End, motion: BoundaryMotion) -> Procedure[None]:
    """Make an end follow a motion, and wait until it is released."""
    element.progress.phase = 'launching'
    element.transducer.drive_end(end, motion)
    while element.transducer.is_driving:
        yield element.count_ticks_to_check(element.transducer.remaining_time)
