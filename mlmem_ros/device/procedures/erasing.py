# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Erasing: throw the wall out, or drive a kink across until it meets the wall."""

from __future__ import annotations

from ..end import End
from ..errors import Astray, ProcedureFailed
from ..memory import Memory
from ..motion import Cycle
from ..move_settings import peak
from ..moves import pushes, throw_cycle, throws
from ..reading import BLANK, describe_level
from .blocks import (
    Procedure,
    Result,
    bring_back,
    bring_ends_back,
    catch_up,
    gone,
    kick_to,
    launch,
    play,
    push,
    return_to_zero,
)
from .listening import look

LOOK_SPACING = 8
"""An erase listens after every cycle at first, then at intervals that grow by an eighth: listening
takes as long as one cycle or several."""


BEYOND = 1.2, 5.0, 2.0
"""Factors on the speed of the fastest kick for a kink that is to run out at the right, one a try:
a short element needs a faster one, and too fast a kick sends waves instead."""

UNPUSHED = 'and what else would drive it out needs an actuator'
"""Ends the error where pushes have failed."""


def erase(element: Memory, *, plainly: bool = False) -> Procedure[Result]:
    """Make the element blank: by a throw if `erase.method` is pulse and not `plainly`, or a kink.

    Raises:
        ProcedureFailed: The element is not blank after all throws and then two cycles per level.
    """
    yield from return_to_zero(element)
    if element.register is not None:
        from .kicking import clear  # few elements hold many walls

        return (yield from clear(element))
    if not plainly and pushes(element.settings):
        pushed = yield from _push(element)
        if pushed is not None:
            return pushed
    if not element.settings.actuator.present:
        raise ProcedureFailed(f'the wall was not pushed out, {UNPUSHED}')
    if not plainly and throws(element.settings):
        thrown = yield from _throw(element)
        if thrown is not None:
            return thrown
    return (yield from _drive_kink(element))


def push_out(element: Memory) -> Procedure[None]:
    """Push the wall out, so that a kick can follow; what pushes do not move is driven out.

    Raises:
        ProcedureFailed: The wall stays, and there is no actuator.
    """
    for pulse in range(element.settings.push.pulses):
        if (yield from _push_once(element, pulse)):
            return
    if not element.settings.actuator.present:
        raise ProcedureFailed(f'the wall was not pushed out, {UNPUSHED}')
    yield from erase(element, plainly=True)


def _push(element: Memory) -> Procedure[Result | None]:
    """Push the wall out; return None if an element that is pushed again and again is not blank."""
    for pulse in range(element.settings.push.pulses):
        element.progress.tried('erase', pulse + 1)
        if (yield from _push_once(element, pulse)):
            reading = yield from look(element)
            if reading.level == BLANK:
                return Result(reading, pulse + 1)
    return None


def _push_once(element: Memory, tried: int) -> Procedure[bool]:
    """Push a wall out at the left end; return whether it has left.

    No push moves a wall that ran past the right end, as after too fast a kick: a kink is sent
    after it, and a wall to meet the kink if that stops short.

    Raises:
        Astray: The end to be driven rests in neither phase, and nothing else moves a wall.
    """
    speeds = element.settings.kick.by_level
    if element.phase(End.RIGHT) != 0 and any(speeds):
        yield from bring_ends_back(element)
        if element.phase(End.LEFT) == 0:
            yield from kick_to(element, element.design.D_s2, max(speeds))
            yield from bring_ends_back(element)
        speed = BEYOND[tried % len(BEYOND)] * max(speeds)
        yield from kick_to(element, element.design.D_s1, speed)
        if (yield from gone(element)):
            return True
    try:
        return (yield from push(element))
    except Astray:
        if not element.settings.actuator.present:
            raise
        return False


def _throw(element: Memory) -> Procedure[Result | None]:
    """Throw the wall out at the left end; return None if it is still heard afterwards.

    It listens after every pulse. A pulse leaves a blank element blank.
    """
    for pulse in range(element.settings.throw.pulses):
        element.progress.tried('erase', pulse + 1)
        element.begin_cycle()
        yield from play(element, throw_cycle(element.settings, pulse))
        reading = yield from look(element)
        if reading.level == BLANK:
            return Result(reading, pulse + 1)
        if None in (element.phase(End.LEFT), element.phase(End.RIGHT)):
            break  # cells in a third ground state, which a kink may still clear
    return None


def _drive_kink(element: Memory) -> Procedure[Result]:
    """Launch a kink and drive it on until it meets the wall.

    At the same site a kink needs the opposite strain of a wall. A probe from the right end shows
    whether the wall is gone: then the echo comes from the far end. With `erase.trust_reading` it
    first listens when the kink is where the wall was read.
    """
    settings = element.settings.erase
    design = element.design
    cycles = 2 * design.levels + 2
    kink, meeting = 0, _meeting(element)
    for _ in range(cycles):
        yield from catch_up(element)
        for end in (End.RIGHT, End.LEFT):
            if element.phase(end) is None:
                yield from bring_back(element, end)
        if element.phase(End.LEFT) != 0:
            element.begin_cycle()
            yield from launch(element, settings, design.D_s1)
            if kink:  # launched again: the prediction no longer holds
                kink = meeting = 0
        late = kink - meeting
        if late >= 0 and late % max(1, late // LOOK_SPACING) == 0:
            reading = yield from look(element)
            if reading.level == BLANK:
                return Result(reading)
        element.begin_cycle()
        compress = not design.freed_by_compression(kink % 2)
        yield from play(element, Cycle.planned(settings, peak(settings, compress)))
        kink += 1
    raise ProcedureFailed(
        f'the element is not blank after {cycles} strain cycles; read last: '
        f'{describe_level(reading.level)}'
    )


def _meeting(element: Memory) -> int:
    """Return after how many cycles the kink meets the wall, if known, to listen from then on.

    The kink begins at level 0 and advances one level per cycle. A wall that compression frees
    has also moved by then; with short levels the two attract from one level apart.
    """
    reading = element.reading
    if not element.settings.erase.trust_reading or reading is None or reading.level < 1:
        return 0
    return reading.level - 1 + element.design.freed_by_compression(reading.level)
