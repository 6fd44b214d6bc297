# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Building blocks of procedures: waits, strains, moves of boundary cells; and the abort, which is
hardly more.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Iterable
from dataclasses import dataclass, field
from typing import TypeVar

from ..commands import PHASE_LAUNCHING, PHASE_SETTLING, PHASE_STRAINING, Check
from ..errors import NotFollowed
from ..instrument.end import End
from ..instrument.instrument import MAX_RUN_TICKS, Instrument
from ..instrument.motion import Cycle
from ..memory import Memory
from ..move_settings import EraseSettings, WriteSettings
from ..moves.planner import kick_speed
from ..readers.reading import Reading

T = TypeVar('T')
Procedure = Generator[int, None, T]
"""Yields the number of ticks after which to resume it; an earlier resumption changes nothing."""

BRING_BACK_SPEED = 0.2
"""Speed for moving an end back from a third ground state; 0.1 to 0.4 was seen to work."""

FOLLOWING_ERROR = 0.1
"""Allowed error of the actuator, as a fraction of its largest strain."""


@dataclass(frozen=True)
class Result:
    """The result of a procedure: last reading, attempts, checks, delays, other findings."""

    reading: Reading | None
    attempts: int = 1
    checks: tuple[Check, ...] = ()
    delays: dict[str, tuple[float, ...]] = field(default_factory=dict)
    found: dict[str, float | str] = field(default_factory=dict)


def run_procedure(
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


def wait_time(element: Instrument, duration: float) -> Procedure[None]:
    """Let whole ticks pass, at least `duration` time units."""
    if duration > 0.0:
        element.progress.phase = PHASE_SETTLING
    end = element.ticks + math.ceil(duration / element.tick)
    while element.ticks < end:
        yield end - element.ticks


def wait_for_samples(element: Instrument) -> Procedure[None]:
    """Wait until the samples of this tick have arrived, because a driver may lag."""
    yield from wait_time(element, element.driver.lag * element.tick)


def ramp_strain(
    element: Instrument, strain: float, duration: float, delay: float = 0.0
) -> Procedure[None]:
    """Move the strain smoothly and wait until it arrives.

    Raises:
        NotFollowed: The actuator does not follow, even in twice the time.
    """
    element.progress.phase = PHASE_STRAINING
    element.actuator.ramp_to(strain, duration, delay)
    while element.actuator.is_moving:
        yield element.count_ticks_to_check(element.actuator.remaining_time)
    allowed = FOLLOWING_ERROR * element.settings.actuator.max_strain
    patience = math.ceil(duration / element.tick)
    while abs((encoder := element.transmission.encoder) - strain) > allowed:
        if patience == 0:
            raise NotFollowed(
                f'the actuator does not follow: it is at a strain of {encoder:.4f} instead of '
                f'{strain:.4f}'
            )
        patience -= 1
        yield 1


def play_cycle(element: Instrument, cycle: Cycle, delay: float = 0.0) -> Procedure[None]:
    """Strain the element through ramps and waits; see `ramp_strain` and `wait_time`."""
    for motion in cycle.motions:
        if motion.still and not element.actuator.is_moving:
            yield from wait_time(element, motion.duration)
        else:
            yield from ramp_strain(element, motion.target, motion.duration, delay)


def launch_wall(
    element: Instrument, times: WriteSettings | EraseSettings, target: float
) -> Procedure[None]:
    """Under a strain, move v_1 to another ground state at constant speed, and release it."""
    rise, *rest = Cycle.plan_cycle(times, times.start_strain).motions
    yield from play_cycle(element, Cycle((rise,)))
    yield from wait_for_samples(element)  # where is the end?
    element.progress.phase = PHASE_LAUNCHING
    element.transducer.move(End.LEFT, target, times.launch_speed)
    while element.transducer.is_driving:
        yield element.count_ticks_to_check(element.transducer.remaining_time)
    yield from play_cycle(element, Cycle(tuple(rest)))


def kick_wall(element: Memory, level: int, force: float = 1.0) -> Procedure[None]:
    """Send a wall from the left end of a blank element to a level.

    `force` is a factor on the speed of the kick, within the transducer's limit.
    """
    speed = force * kick_speed(element.design, element.settings, level)
    yield from wait_for_samples(element)  # where is the end?
    yield from kick_end(element, element.design.D_s2, speed)


def kick_end(
    element: Memory, target: float, speed: float, settle: float | None = None
) -> Procedure[None]:
    """Move the left end smoothly to a ground state and hold it; what it sends comes to rest.

    `settle` is the rest afterwards, by default that of the settings.
    """
    settings = element.settings.kick
    element.begin_cycle('kicked')
    element.progress.phase = PHASE_LAUNCHING
    speed = min(speed, element.settings.transducer.max_speed / settings.peak_speed_ratio)
    element.transducer.kick(target, speed)
    yield from _wait_while_driven(element)
    yield from wait_time(element, settings.settle if settle is None else settle)


def send_wall(element: Memory, of_wall: float, of_kink: float) -> Procedure[None]:
    """Send a wall, or a kink if the left end is active, to the level of its speed."""
    yield from bring_ends_back(element, (End.LEFT,))
    if element.phase(End.LEFT) == 1:
        yield from kick_end(element, element.design.D_s1, of_kink)
    else:
        yield from kick_end(element, element.design.D_s2, of_wall)


def fire_clearing_pulse(element: Memory) -> Procedure[None]:
    """Drive an end with the clearing pulse; raises as `Instrument.require_phase`."""
    settings = element.settings.clearing_pulse
    element.require_phase(End(settings.end))
    element.begin_cycle('cleared')
    element.progress.phase = PHASE_LAUNCHING
    element.transducer.clear(End(settings.end), settings)
    yield from _wait_while_driven(element)


def _wait_while_driven(element: Memory) -> Procedure[None]:
    """Wait while an end is driven, which moves a wall as a strain does."""
    while element.transducer.is_driving:
        yield element.count_ticks_to_check(element.transducer.remaining_time)
    element.last_moved = element.ticks


def bring_end_back(element: Memory, end: End) -> Procedure[None]:
    """Move an end that strayed into a third ground state back to the active phase.

    A wall driven over a free end returns as a wall between the active phase and the next. No
    strain moves it, but the wall launched here removes it within some 90 cells.
    """
    element.forget('an end was brought back')
    element.progress.phase = PHASE_LAUNCHING
    element.transducer.move(end, element.design.D_s2, BRING_BACK_SPEED)
    while element.transducer.is_driving:
        yield element.count_ticks_to_check(element.transducer.remaining_time)
    yield from wait_time(element, element.settings.erase.settle)
    yield from wait_for_samples(element)


def bring_ends_back(element: Memory, ends: Iterable[End] = End) -> Procedure[None]:
    """Bring back those of some ends that strayed."""
    yield from wait_for_samples(element)
    for end in ends:
        if element.phase(end) is None:
            yield from bring_end_back(element, end)


def return_to_zero(element: Memory) -> Procedure[None]:
    """Bring a strain that was set by hand back to zero, and let the element settle.

    With the slow times of an erase: a write may return within a tick.
    """
    if element.actuator.strain != 0.0 or element.actuator.is_moving:
        element.forget('strained by a procedure')
        yield from play_cycle(
            element, Cycle.release(element.settings.erase, element.actuator.strain)
        )


def abort(element: Memory) -> Procedure[Result]:
    """Release a held cell and bring the strain to zero, smoothly.

    As slowly as an erase: at the highest rate, one element in twenty was left with cells in a
    third ground state, which no strain clears (see `bring_end_back`).
    """
    times = element.settings.erase
    element.transducer.release()
    if element.actuator.strain != 0.0 or element.actuator.is_moving:
        yield from ramp_strain(element, 0.0, times.release)
    return Result(None)
