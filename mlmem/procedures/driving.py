# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Driving the wall: send or drive a kink across until it meets the wall; and take the wall to a
level by the fastest moves, open loop.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ..errors import NotFollowed, ProcedureFailed
from ..instrument.end import End
from ..instrument.motion import Cycle
from ..memory import Memory
from ..move_settings import select_peak
from ..moves.corrections import PulseCorrection, apply_correction
from ..moves.planner import (
    How,
    Move,
    disable_kicks,
    erase_speed,
    find_route,
    half_period,
    soften_release,
    step_cycle,
)
from ..readers.reading import BLANK, UNDECODABLE, describe_level
from ..settings import Settings
from .blocks import (
    Procedure,
    Result,
    bring_end_back,
    bring_ends_back,
    kick_end,
    kick_wall,
    launch_wall,
    play_cycle,
    return_to_zero,
    wait_for_samples,
)
from .listening import take_reading, try_wait_for_decay

READ_SPACING_CYCLES = 8
"""An erase listens after every cycle at first, then at intervals that grow by an eighth: listening
takes as long as one cycle or several."""


OVERSHOOT_FACTORS = 1.2, 5.0, 2.0
"""Factors on the speed of the fastest kick for a kink that is to run out at the right, one a try:
a short element needs a faster one, and too fast a kick sends waves instead."""


def erase(element: Memory, *, plainly: bool = False) -> Procedure[Result]:
    """Make the element blank: by a kick unless `plainly`, or else by a kink that strain drives.

    Raises:
        ProcedureFailed: The element is not blank after all kicks and then two cycles per level.
    """
    yield from return_to_zero(element)
    if element.register is not None:
        from .many_walls import clear_and_read  # few elements hold many walls

        return (yield from clear_and_read(element))
    if not plainly and erase_speed(element.design, element.settings):
        erased = yield from _erase_by_kicks(element)
        if erased is not None:
            return erased
    if not element.settings.actuator.present:
        raise ProcedureFailed(
            'the wall was not kicked out, and what else would drive it out needs an actuator'
        )
    return (yield from _drive_kink(element))


def _erase_by_kicks(element: Memory) -> Procedure[Result | None]:
    """Kick the wall out; return None if an element that is kicked again and again is not blank."""
    yield from wait_for_samples(element)
    for attempt in range(1, element.settings.write.attempts + 1):
        element.progress.tried('erase', attempt)
        if attempt > 1 or (element.phase(End.LEFT), element.phase(End.RIGHT)) != (0, 0):
            yield from kick_out(element, attempt)
        reading = yield from take_reading(element)
        if reading.level == BLANK:
            return Result(reading, attempt)
    return None


def kick_out(element: Memory, attempt: int = 1) -> Procedure[None]:
    """Send a kink from the left end to the wall, which takes both away.

    If the left end is inactive, there is a kink already, which did not arrive: first a wall is
    sent to it. A wall that ran past the right end is followed by a kink that does so, too.
    """
    design, settings = element.design, element.settings.kick
    fastest = max(settings.wall_speeds)
    yield from bring_ends_back(element)
    if element.phase(End.LEFT) == 0:
        yield from kick_end(element, design.D_s2, fastest)
        yield from bring_ends_back(element)
    speed = settings.erase_speed
    if element.phase(End.RIGHT) != 0:
        speed = fastest * OVERSHOOT_FACTORS[(attempt - 1) % len(OVERSHOOT_FACTORS)]
    yield from kick_end(element, design.D_s1, speed, settings.erase_settle)


def _drive_kink(element: Memory) -> Procedure[Result]:
    """Launch a kink and drive it on until it meets the wall.

    At the same site a kink needs the opposite strain of a wall. A probe from the right end shows
    whether the wall is gone: then the echo comes from the far end. With `erase.trust_reading` it
    first listens when the kink is where the wall was read.
    """
    settings = element.settings.erase
    design = element.design
    cycles = 2 * design.levels + 2
    kink, meeting = 0, _count_meeting_cycles(element)
    for _ in range(cycles):
        yield from wait_for_samples(element)
        for end in (End.RIGHT, End.LEFT):
            if element.phase(end) is None:
                yield from bring_end_back(element, end)
        if element.phase(End.LEFT) != 0:
            element.begin_cycle()
            yield from launch_wall(element, settings, design.D_s1)
            if kink:  # launched again: the prediction no longer holds
                kink = meeting = 0
        late = kink - meeting
        if late >= 0 and late % max(1, late // READ_SPACING_CYCLES) == 0:
            reading = yield from take_reading(element)
            if reading.level == BLANK:
                return Result(reading)
        element.begin_cycle()
        compress = not design.is_freed_by_compression(kink % 2)
        yield from play_cycle(element, Cycle.plan_cycle(settings, select_peak(settings, compress)))
        kink += 1
    raise ProcedureFailed(
        f'the element is not blank after {cycles} strain cycles; read last: '
        f'{describe_level(reading.level)}'
    )


def _count_meeting_cycles(element: Memory) -> int:
    """Return after how many cycles the kink meets the wall, if known, to listen from then on.

    The kink begins at level 0 and advances one level per cycle. A wall that compression frees
    has also moved by then; with short levels the two attract from one level apart.
    """
    reading = element.reading
    if not element.settings.erase.trust_reading or reading is None or reading.level < 1:
        return 0
    return reading.level - 1 + element.design.is_freed_by_compression(reading.level)


def go_to_level(
    element: Memory,
    present: int,
    level: int,
    force: float = 1.0,
    *,
    nudge: float = 1.0,
    plainly: bool = False,
    strained: bool = True,
    corrections: Sequence[PulseCorrection] | None = None,
) -> Procedure[None]:
    """Drive the wall from the level that was read to another by the fastest moves, open loop.

    Args:
        force: Factor on the peak strains of steps up, within the actuator's limit.
        nudge: Factor on the speed of a kick, within the transducer's limit.
        plainly: Use only steps up and a kink, as in the paper.
        strained: Whether to use the actuator, if there is one.
        corrections: By the level to which a move goes; by default those of the calibration.

    Raises:
        ProcedureFailed: There is no way; `NotFollowed` if there is only one by strain, and the
            actuator does not follow.
    """
    design, settings = element.design, element.settings
    if corrections is None:
        corrections = element.calibration.corrections_by_level(settings)
    settings = (
        disable_kicks(settings) if plainly else element.calibration.remove_missed_kicks(settings)
    )
    if not strained:
        settings = replace(settings, actuator=replace(settings.actuator, present=False))
    if present == UNDECODABLE:
        yield from erase(element, plainly=plainly)
        present = BLANK
    moves = find_route(design, settings, present, level)
    for move in moves:
        if move.how is How.KICK_OUT:
            yield from kick_out(element)
            continue
        if move.how is How.KICK:
            yield from kick_wall(element, move.target, corrections[move.target].speed * nudge)
            continue
        if move.how is How.ERASE:
            yield from erase(element, plainly=plainly)
            continue
        last = move is moves[-1] and move.how is not How.LAUNCH
        try:
            yield from _strain_wall(
                element,
                soften_release(settings) if last else settings,
                move,
                corrections[move.target],
                force,
            )
        except NotFollowed as failure:
            needy = f'a {move.how.value} to {describe_level(move.target)} needs strain'
            raise NotFollowed(f'{needy}, and {failure}') from None
    yield from try_wait_for_decay(element, settings.write.final_settle)


def _strain_wall(
    element: Memory, settings: Settings, move: Move, correction: PulseCorrection, force: float
) -> Procedure[None]:
    design = element.design
    element.begin_cycle()
    if move.how is How.LAUNCH:
        yield from launch_wall(element, apply_correction(settings, correction).write, design.D_s2)
        return
    settings = apply_correction(settings, correction)
    delay = half_period(design) if settings.write.shaped else 0.0
    yield from play_cycle(element, step_cycle(design, settings, move.start, force), delay)
