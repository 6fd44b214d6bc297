# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Write, read, erase and calibrate, as sequences that the tick loop advances.

A procedure is a generator: what it does before a `yield` takes effect in the tick that follows.
It never sleeps and never looks at a clock, and it knows only what the device can measure: the
displacements of the two ends, never the true wall position.
"""

from __future__ import annotations

import math
from collections.abc import Generator
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar

from ..physics.dispersion import group_velocity
from .calibration import Calibration, DelayTable
from .errors import ProcedureFailed, SettingsError
from .events import describe_level
from .reading import BLANK, UNDECODABLE, Reading
from .settings import CycleSettings

if TYPE_CHECKING:
    from .element import MemoryElement

T = TypeVar('T')
Procedure = Generator[None, None, T]

ECHO_TAIL = 150.0
"""How long a read listens on after the first crossing, for the echo's peak, in time units."""

SLOWEST = 0.15
"""Least group velocity, in cells per time unit, for which the listening time is made."""


BRING_BACK_SPEED = 0.2
"""Speed at which an end in a third ground state is moved back; 0.1 to 0.4 was seen to work."""


@dataclass(frozen=True)
class Result:
    """What a procedure leaves: its last reading and how many tries it took."""

    reading: Reading | None
    attempts: int = 1


# --- building blocks -------------------------------------------------------------------------


def wait(element: MemoryElement, duration: float) -> Procedure[None]:
    """Let whole ticks pass, at least `duration` time units."""
    for _ in range(math.ceil(duration / element.tick)):
        yield


def ramp(element: MemoryElement, strain: float, duration: float) -> Procedure[None]:
    """Move the strain smoothly and wait until it is there."""
    element.actuator.ramp_to(strain, duration)
    while element.actuator.moving:
        yield


def cycle(element: MemoryElement, peak: float, times: CycleSettings) -> Procedure[None]:
    """Strain the element to a peak and let go: ramp, hold, ramp back, settle."""
    yield from ramp(element, peak, times.ramp)
    yield from wait(element, times.hold)
    yield from ramp(element, 0.0, times.release)
    yield from wait(element, times.settle)


def launch(
    element: MemoryElement, strain: float, target: float, speed: float, times: CycleSettings
) -> Procedure[None]:
    """Under a strain, move v_1 to another ground state at constant speed, and let it go."""
    yield from ramp(element, strain, times.ramp)
    element.transducer.move('left', target, speed)
    while element.transducer.driving:
        yield
    yield from wait(element, times.hold)
    yield from ramp(element, 0.0, times.release)
    yield from wait(element, times.settle)


def bring_back(element: MemoryElement, end: str) -> Procedure[None]:
    """Move an end that strayed into a third ground state back to the active phase.

    A wall that is driven over a free end comes back as one between the active phase and the
    next. No strain moves it, but the wall that this launches does away with it where it is
    within some 90 cells.
    """
    element.forget()
    element.transducer.move(end, element.design.D_s2, BRING_BACK_SPEED)
    while element.transducer.driving:
        yield
    yield from wait(element, element.settings.erase.settle)


def quiet(element: MemoryElement) -> Procedure[None]:
    """Wait until the strain stands still and both ends are quiet enough for an echo detector.

    Both, because a wave that still runs to and fro at one end is on its way to the other.

    Raises:
        ProcedureFailed: They did not become quiet within `read.patience`.
    """
    while element.actuator.moving:  # a strain set by hand: the wall may be under way
        yield
    transducer, share = element.transducer, element.settings.read.quiet
    limits = {end: share * probe.v_th for end, probe in transducer.probes.items()}
    patience = math.ceil(element.settings.read.patience / element.tick)
    while loud := [end for end, limit in limits.items() if transducer.unrest(end) > limit]:
        if patience == 0:
            raise ProcedureFailed(
                f'the {loud[0]} end does not come to rest: it moves by '
                f'{transducer.unrest(loud[0]):.2g} and at most {limits[loud[0]]:.2g} lets an '
                'echo be heard'
            )
        patience -= 1
        yield


def listening_time(element: MemoryElement, end: str) -> float:
    """Return how long an echo can take: there and back over the whole element, and its tail."""
    probe = element.transducer.probes[end]
    k_s = element.design.k_s2 if end == 'left' else element.design.k_s1
    speed = max(SLOWEST, float(group_velocity(probe.omega_c, k_s)))
    return 12.0 * probe.sigma + 2.0 * element.design.N / speed + ECHO_TAIL


def probe(element: MemoryElement, end: str) -> Procedure[Reading]:
    """Fire one pulse, listen, decode, and tell what was heard."""
    yield from quiet(element)
    detector = element.transducer.fire(end)
    last = listening_time(element, end)
    while detector.time < last:
        yield
        if detector.delay is not None:
            last = min(last, detector.delay + ECHO_TAIL)
    element.transducer.release()
    return element.hear(detector.echo(end))


def look(element: MemoryElement) -> Procedure[Reading]:
    """Probe from the end in the settings, or from the right where the left hears nothing.

    The left end's carrier lies above the band of the inactive phase, so that a blank element
    can only be told from the right.
    """
    yield from quiet(element)
    deaf = element.phase('left') == 0
    return (yield from probe(element, 'right' if deaf else element.settings.read.end))


def slacken(element: MemoryElement) -> Procedure[None]:
    """Bring a strain that was set by hand back to zero, and let the element settle."""
    if element.actuator.strain != 0.0 or element.actuator.moving:
        element.forget()
        yield from ramp(element, 0.0, element.settings.write.release)
        yield from wait(element, element.settings.write.settle)


# --- procedures ------------------------------------------------------------------------------


def read(element: MemoryElement, end: str = '') -> Procedure[Result]:
    """Fire a probe pulse from an end and decode the echo.

    Raises:
        ProcedureFailed: The echo cannot be decoded, or the element does not come to rest.
    """
    reading = yield from (probe(element, end) if end else look(element))
    if reading.level == UNDECODABLE:
        raise ProcedureFailed(reading.reason)
    return Result(reading)


def write(element: MemoryElement, level: int) -> Procedure[Result]:
    """Write a level: step up to it, or erase and start again; then verify by reading.

    Raises:
        ProcedureFailed: The level was not reached within `write.attempts`.
    """
    attempts = element.settings.write.attempts
    yield from slacken(element)
    reading = element.reading
    if reading is None or reading.level == UNDECODABLE:
        reading = yield from look(element)
    seen = []
    for attempt in range(1, attempts + 1):
        try:
            yield from _toward(element, reading.level, level)
            reading = yield from look(element)
        except ProcedureFailed as failure:
            raise ProcedureFailed(str(failure), attempt) from failure
        if reading.level == level:
            return Result(reading, attempt)
        seen.append(describe_level(reading.level))
    raise ProcedureFailed(
        f'level {level} was not reached in {attempts} attempts; read instead: {", ".join(seen)}',
        attempts,
    )


def _toward(element: MemoryElement, present: int, level: int) -> Procedure[None]:
    """Drive the wall from the level that was read to another, without looking."""
    settings = element.settings.write
    if present == UNDECODABLE or present > level:
        yield from erase(element)
        present = BLANK
    if present == BLANK:
        element.forget()
        yield from launch(
            element, settings.start_strain, element.design.D_s2, settings.launch_speed, settings
        )
        present = 0
    for step in range(present, level):
        element.forget()
        compress = element.design.freed_by_compression(step)
        peak = settings.compression if compress else settings.tension
        yield from cycle(element, peak, settings)


def erase(element: MemoryElement) -> Procedure[Result]:
    """Make the element blank: launch a kink and drive it on until it meets the wall.

    A kink answers to the opposite strain of a wall at the same site. Whether the wall is gone
    is heard from the right end, where a blank element echoes from its far end.

    Raises:
        ProcedureFailed: The element is not blank after two cycles for every level.
    """
    settings = element.settings.erase
    design = element.design
    yield from slacken(element)
    cycles = 2 * design.levels + 2
    kink = 0
    for _ in range(cycles):
        for end in ('right', 'left'):
            if element.phase(end) is None:
                yield from bring_back(element, end)
        if element.phase('left') != 0:
            element.forget()
            yield from launch(
                element, settings.start_strain, design.D_s1, settings.launch_speed, settings
            )
            kink = 0
        reading = yield from probe(element, 'right')
        if reading.level == BLANK:
            return Result(reading)
        element.forget()
        tense = design.freed_by_compression(kink % 2)
        yield from cycle(element, settings.tension if tense else settings.compression, settings)
        kink += 1
    raise ProcedureFailed(
        f'the element is not blank after {cycles} strain cycles; read last: '
        f'{describe_level(reading.level)}'
    )


def calibrate(element: MemoryElement) -> Procedure[Result]:
    """Learn the delay of every level from both ends, then restore the content.

    Every new delay has to be nearest to that of its own level in the present calibration: a
    step that failed would give a table whose levels are all one off.

    Raises:
        ProcedureFailed: The wall did not follow or the delays do not tell the levels apart
            (the old calibration is kept, the content is not), or the content could not be
            restored.
    """
    yield from slacken(element)
    content = yield from look(element)
    result = yield from erase(element)
    delays: dict[str, list[float]] = {'left': [], 'right': []}
    for level in range(element.design.levels):
        yield from _toward(element, level - 1, level)
        for end, known in delays.items():
            reading = yield from probe(element, end)
            if reading.delay is None:
                raise ProcedureFailed(f'level {level} gives no echo at the {end} end')
            nearest, _ = element.calibration.table(end).nearest(reading.delay)
            if nearest != level:
                raise ProcedureFailed(
                    f'the calibration was not taken: on the way to level {level} the {end} end '
                    f'hears {describe_level(nearest)}, at {reading.delay:.2f}'
                )
            known.append(reading.delay)
    blank = result.reading.delay if result.reading else None
    try:
        element.calibration = Calibration(
            DelayTable(tuple(delays['left'])), DelayTable(tuple(delays['right']), blank)
        )
    except SettingsError as error:
        raise ProcedureFailed(f'the calibration was not taken: {error}') from error
    if content.level >= 0:
        return (yield from write(element, content.level))
    return (yield from erase(element))


def abort(element: MemoryElement) -> Procedure[Result]:
    """Let a held cell go and bring the strain to zero, smoothly.

    As slowly as a cycle does: let go at the greatest rate, one element in twenty was left with
    cells in a third ground state, which no strain clears (see `bring_back`).
    """
    detector = element.transducer.detector
    element.transducer.release()
    if element.actuator.strain != 0.0 or element.actuator.moving:
        element.forget()
        yield from ramp(element, 0.0, element.settings.write.release)
    elif detector is not None:  # the next read must not take this pulse's echo for its own
        element.transducer.detector = detector  # and an abort of this abort has to wait as well
        yield from wait(element, element.settings.write.settle)
        element.transducer.release()
    return Result(None)
