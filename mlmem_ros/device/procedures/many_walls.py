# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Many walls: shift all whose turn it is, or kick each to its level and push all out.

Half a cycle of strain shifts by one level: compression frees walls at every second level and kinks
at the others, tension the rest. So walls and kinks that take turns keep step, as in a shift
register. A long one is filled from the left: a wall that is launched before a compression and a
kink that is launched before a tension keep step with those before them. A weak tension frees a
kink, and no wall: then kinks go on until each meets the wall ahead of it, and both are gone.

A kick needs no strain. It is a smooth move of the left end to its other ground state, and sends a
wall, or a kink behind walls that rest already, to the level that its speed selects. So a word is
filled from the right.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ...physics import Design
from ..echo import pulse_duration
from ..end import End
from ..errors import ProcedureFailed
from ..instrument import Instrument
from ..memory import Memory
from ..motion import Cycle
from ..move_settings import peak
from ..moves import gentle, half_period
from ..reading import UNDECODABLE, Reading
from ..settings import Settings
from ..words import Code
from .blocks import Procedure, Result, bring_ends_back, fire_push, play, return_to_zero, send, wait
from .listening import hear, listen, wait_for_quiet

if TYPE_CHECKING:
    from ..peeling import Peeled
    from ..register import Register

HALVES = ('compression', 'tension')


def shift(element: Memory, half: str) -> Procedure[Result]:
    """Strain the element by half a cycle, and listen.

    Without a half, that one which frees most of the walls that were read. What it does not free
    stays. A wall beyond the last level leaves the element or waits in its tail.

    Raises:
        ProcedureFailed: What it holds cannot be read, before (without a half) or afterwards, or
            is not what was read before, shifted: walls that come near one another annihilate.
    """
    yield from return_to_zero(element)
    before = element.reading
    if not half and (before is None or before.level == UNDECODABLE):
        before = yield from listen(element)
        if before.level == UNDECODABLE:
            raise ProcedureFailed(f'name a half: the content cannot be read ({before.reason})')
    if before is not None and before.level != UNDECODABLE:
        levels, free = _freed(element, before)
        half = half or HALVES[sum(free) * 2 < len(free)]
    settings = element.calibration.adapt(element.settings)
    element.begin_cycle()
    yield from strain(element, settings, half, kinks=element.register is not None)
    yield from wait_for_quiet(element, settings.write.final_settle)
    reading = yield from listen(element)
    if reading.level == UNDECODABLE:
        raise ProcedureFailed(f'after a {half} what it holds cannot be read: {reading.reason}')
    if before is not None and before.level != UNDECODABLE:
        moved = [n + (one == (half == HALVES[0])) for n, one in zip(levels, free, strict=True)]
        inside = [level for level in moved if level < element.design.levels]
        found, _ = _freed(element, reading)
        if inside != found:
            raise ProcedureFailed(
                f'a {half} was to take the walls from levels {levels} to {moved}, not to {found}: '
                'walls that come near one another annihilate'
            )
    return Result(reading, found={'half': half})


def strain(element: Instrument, settings: Settings, half: str, *, kinks: bool) -> Procedure[None]:
    """Strain an element by a half."""
    delay = half_period(element.design) if settings.write.shaped else 0.0
    yield from play(element, cycle(settings, half, kinks=kinks), delay)


def cycle(settings: Settings, half: str, *, kinks: bool) -> Cycle:
    """Return the strain of a half: that of a step up, or, if there may be kinks, of the greater of
    this and that of an erase, which drives one.
    """
    settings, limit = gentle(settings), settings.actuator.max_strain
    found = peak(settings.write, half == HALVES[0])
    if kinks:
        found = max(found, peak(settings.erase, half == HALVES[0]), key=abs)
    strain = max(-limit, min(found, limit))
    return Cycle.planned(settings.write, strain, settings.actuator.max_rate)


def _freed(element: Memory, reading: Reading) -> tuple[list[int], list[bool]]:
    """Return the levels of the walls in a reading, and which of them a compression frees."""
    register, design = element.register, element.design
    if register is not None:
        levels = list(register.code.walls(reading.level))
    else:
        levels = [reading.level] if reading.level >= 0 else []
    return levels, [
        design.freed_by_compression(level) != bool((len(levels) - 1 - place) % 2)
        for place, level in enumerate(levels)
    ]


# --- into and out of a long register, from the left ----------------------------------------------

MORE = 4
"""Cycles beyond those after which the last kink should have met its wall."""


def shift_in(element: Memory, walls: Sequence[int]) -> Procedure[None]:
    """Shift the walls of a word, levels from the left, into a blank element."""
    last = walls[-1] if walls else 0
    launched = {last - level for level in walls}
    for cycle in range(last + 1):
        if cycle in launched:
            yield from enter(element)
        if cycle < last:
            element.begin_cycle()
            yield from strain(element, element.settings, HALVES[cycle % 2], kinks=False)
    yield from wait_for_quiet(element, element.settings.write.final_settle)


def annihilate(element: Memory, code: Code, present: int) -> Procedure[None]:
    """Let every kink meet the wall ahead of it, in an element that holds a word or is unknown."""
    yield from bring_ends_back(element)
    times, rate = element.settings.erase, element.settings.actuator.max_rate
    for cycle in range(passages(code, present)):
        if cycle == 1 and element.phase(End.LEFT) == 1:
            yield from enter(element)
        element.begin_cycle()
        weak = Cycle.planned(times, peak(times, cycle % 2 == 0), rate)
        yield from play(element, weak, half_period(element.design))


def passages(code: Code, present: int) -> int:
    """Return how many cycles it takes until the element is blank; 0 if it is."""
    if present == UNDECODABLE:
        return code.levels + MORE
    if not (walls := code.walls(present)):
        return 0
    places = [-1, *walls] if len(walls) % 2 else list(walls)
    return MORE + max(b - a for a, b in zip(places[::2], places[1::2], strict=True))


def shifting_time(
    design: Design, settings: Settings, code: Code, present: int, word: int
) -> float:
    """Return how long it takes to bring a word into an element that holds another."""
    walls, kick = code.walls(word), settings.kick
    times = [Cycle.planned(each, 0.0).duration for each in (settings.erase, settings.write)]
    moved = abs(design.D_s2 - design.D_s1)
    speeds = (kick.by_level[0], kick.of_kinks[0])
    entering = sum(
        moved / speeds[n % 2] + kick.hold + kick.settle for n in range(len(walls) + (present != 0))
    )
    return passages(code, present) * times[0] + (walls[-1] if walls else 0) * times[1] + entering


def enter(element: Memory) -> Procedure[None]:
    """Send a wall, or a kink if the left end is active, to level 0."""
    kick = element.settings.kick
    yield from send(element, kick.by_level[0], kick.of_kinks[0])


# --- each to its level, from the right -----------------------------------------------------------


def push_all(element: Memory) -> Procedure[None]:
    """Bring back ends that strayed, fire a loud pulse that takes all walls out, and let its waves
    decay.
    """
    yield from bring_ends_back(element)
    yield from fire_push(element)
    yield from wait(element, element.settings.push.settle)


def put(element: Memory, register: Register | Peeled, present: int, word: int) -> Procedure[None]:
    """Bring a word into an element that holds another, open loop.

    Walls stay if none is to their right that must go, and none is missing there. Otherwise all
    are pushed out. In a register that is shifted all annihilate, and the word is shifted in.
    """
    if register.code.odd:
        yield from annihilate(element, register.code, present)
        yield from shift_in(element, register.code.walls(word))
        return
    pushed, speeds = way(element.settings, register.code, present, word)
    if pushed:
        yield from push_all(element)
    for speed in speeds:
        yield from send(element, speed, speed)


def way(settings: Settings, code: Code, present: int, word: int) -> tuple[bool, list[float]]:
    """Return whether to push all walls out first, and the speeds of the kicks from there on."""
    wanted = code.walls(word)
    kept = () if present == UNDECODABLE else code.walls(present)
    pushed = present == UNDECODABLE or wanted[len(wanted) - len(kept) :] != kept
    first = 0 if pushed else len(kept)
    speeds = settings.kick.by_level, settings.kick.of_kinks
    return pushed, [speeds[k % 2][wanted[-1 - k]] for k in range(first, len(wanted))]


def kicking_time(design: Design, settings: Settings, pushed: bool, speeds: list[float]) -> float:
    """Return how long `way` takes, in time units."""
    moved = abs(design.D_s2 - design.D_s1)
    kick, loud = settings.kick, settings.push
    kicks = sum(moved / speed + kick.hold + kick.settle for speed in speeds)
    return kicks + pushed * (pulse_duration(loud) + loud.settle)


def clear(element: Memory) -> Procedure[Result]:
    """Push all walls out, and listen.

    Raises:
        ProcedureFailed: The element is not blank after `write.attempts` pulses.
    """
    attempts, register = element.settings.write.attempts, element.register
    assert register is not None
    for attempt in range(1, attempts + 1):
        element.progress.tried('erase', attempt)
        if register.code.odd:
            present = element.reading.level if element.reading else UNDECODABLE
            yield from annihilate(element, register.code, present)
        else:
            yield from push_all(element)
        reading = yield from hear(element)
        if reading.level == 0:
            return Result(reading, attempt)
    how = 'passages' if register.code.odd else 'pulses'
    raise ProcedureFailed(
        f'the element is not blank after {attempts} {how}: {reading.reason or reading.code}',
        attempts,
    )
