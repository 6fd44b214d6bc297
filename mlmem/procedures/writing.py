# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Writing: drive the walls to a content by the fastest moves, verify, and try again; drive them
out of the element; kick one by hand; and the abort of it all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ..commands import Outcome
from ..errors import ErrorCode, NotFollowed, ProcedureFailed, Refused
from ..instrument.blocks import Procedure, catch_up, ramp_strain
from ..memory import Memory
from ..moves.kick import kick_duration, kick_to_other_phase, remove_missed_kicks
from ..moves.move import Drive, Move, blank_content, disable_kicks, erasing_moves, find_route
from ..moves.strain_cycle import return_to_zero
from ..readers.calibration import PulseCorrection
from ..readers.listening import expected_wait, try_wait_for_decay
from ..readers.reading import BLANK, UNDECODABLE, Reading, correct_speed, describe_level


def write(element: Memory, level: int) -> Procedure[Outcome]:
    """Write a level: step up to it, down to it, or erase and start again; verify by reading.

    A further attempt continues from the level that was read, with peak strains `write.escalation`
    times greater, because a wall that did not follow was not pulled hard enough. A wall that
    stopped on its way also reads as the nearest level, but later steps would fail: with a margin
    below `write.min_margin` it is written again. The last attempt uses only steps up and a kink.
    A kick that went too far is made slower, one that fell short faster. With `write.method` auto
    an actuator that does not follow is left alone: kicks go on.
    Where both ends hear something and do not agree, it listens once more.

    Raises:
        ProcedureFailed: The level was not reached within `write.attempts`.
    """
    yield from return_to_zero(element)
    reading = element.reading
    if reading is None or reading.level == UNDECODABLE:
        reading = yield from element.reader.read_settled(element)
    present, seen, nudge = reading.level, [], 1.0
    settings, attempts = element.settings.write, element.settings.write.attempts
    strained = element.settings.actuator.present
    for attempt in range(1, attempts + 1):
        element.progress.record_attempts('write', attempt)
        element.expect_duration(writing_time(element, present, level))
        try:
            plainly = strained and not settings.avoids_strain and 1 < attempt == attempts
            force = min(settings.escalation ** (attempt - 1), settings.escalation_limit)
            try:
                yield from go_to_level(
                    element, present, level, force,
                    nudge=nudge, plainly=plainly, strained=strained,
                )  # fmt: skip
            except NotFollowed:
                if settings.avoids_strain or not (settings.uses_kicks and strained):
                    raise
                strained = False  # from here on by kicks
                yield from return_to_zero(element)
            reading = yield from element.reader.read_after_move(element)
        except ProcedureFailed as failure:
            raise ProcedureFailed(str(failure), attempt) from failure
        present = reading.level
        if present >= 0 and reading.level_margin < settings.min_margin:
            present = UNDECODABLE
        if present == level:
            return Outcome(reading, attempt)
        nudge *= correct_speed(element, reading, level, attempt)
        result = reading.reason or element.describe_content(reading.level)
        if present != reading.level:
            result = f'{result} with a margin of {reading.level_margin:.2f}'
        seen.append(result)
    raise ProcedureFailed(
        f'{element.describe_content(level)} was not reached in {attempts} attempts; read instead: '
        f'{", ".join(seen)}',
        attempts,
    )


def restore_content(element: Memory, content: Reading) -> Procedure[Outcome]:
    """Restore a reading: write its level, or erase if it was blank.

    Raises:
        ProcedureFailed: It cannot be restored.
    """
    if content.level >= 0:
        return (yield from write(element, content.level))
    return (yield from erase(element))


def erase(element: Memory, *, plainly: bool = False) -> Procedure[Outcome]:
    """Make the element blank: without strain unless `plainly`, or else with it.

    Raises:
        ProcedureFailed: The element is not blank after all moves that erase.
    """
    yield from return_to_zero(element)
    settings = disable_kicks(element.settings) if plainly else element.settings
    how = Drive(element.pulse_corrections)
    reading: Reading | None = None
    for move in erasing_moves(element.design, settings):
        if move.listens:
            return Outcome((yield from move.drive(element, how)))
        for attempt in range(1, settings.write.attempts + 1):
            element.progress.record_attempts('erase', attempt)
            if attempt == 1 and not settings.holds_words:
                yield from catch_up(element)
            # the ends tell nothing of many walls
            if attempt > 1 or settings.holds_words or element.phases != (0, 0):
                yield from move.drive(element, how)
            reading = yield from element.reader.read(element)
            if reading.level == blank_content(settings):
                return Outcome(reading, attempt)
    seen = reading and (reading.reason or element.describe_content(reading.level))
    raise ProcedureFailed(
        f'the element is not blank after {settings.write.attempts} attempts ({seen}); no other '
        'move erases it: strain does, with an actuator and one wall',
        settings.write.attempts,
    )


def kick_by_hand(element: Memory, speed: float) -> Procedure[Outcome]:
    """Kick a wall off from the left end, or a kink if that end is active; nothing is read.

    `speed` is the mean one of the end in cells per time unit, within the transducer's limit.

    Raises:
        NotFollowed: The strain was not zero, and the actuator does not bring it there.
    """
    yield from return_to_zero(element)
    element.forget_content('kicked by hand')
    yield from kick_to_other_phase(element, speed)
    return Outcome(None)


def abort(element: Memory) -> Procedure[Outcome]:
    """Release a held cell and bring the strain to zero, smoothly.

    As slowly as an erase: at the highest rate, one element in twenty was left with cells in a
    third ground state, which no strain clears (see `bring_ends_back`).
    """
    times = element.settings.erase
    element.transducer.release_ends()
    if element.actuator.strain != 0.0 or element.actuator.is_moving:
        yield from ramp_strain(element, 0.0, times.release)
    return Outcome(None)


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
    """Drive the walls from the content that was read to another by the fastest moves, open loop.

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
    corrections = corrections or element.pulse_corrections
    if plainly:
        settings = disable_kicks(settings)
    else:
        settings = remove_missed_kicks(settings, element.pulse_corrections)
    if not strained:
        settings = replace(settings, actuator=replace(settings.actuator, present=False))
    if present == UNDECODABLE and not settings.holds_words:
        yield from erase(element, plainly=plainly)
        present = blank_content(settings)
    how = Drive(corrections, force, nudge)
    moves: list[Move] = find_route(design, settings, present, level)
    for move in moves:
        try:
            yield from move.drive(element, replace(how, is_last=move is moves[-1]))
        except NotFollowed as failure:
            needy = f'a {move.name} to {describe_level(move.target)} needs strain'
            raise NotFollowed(f'{needy}, and {failure}') from None
    yield from try_wait_for_decay(element, settings.write.final_settle)


# --- how long it takes, in time units, for display only: what is unexpected is added as it occurs


def find_content(element: Memory) -> int:
    """Return the content, as far as known: a level, `BLANK` or `UNDECODABLE`."""
    return UNDECODABLE if element.reading is None else element.reading.level


def driving_time(element: Memory, present: int, target: int) -> float:
    """Return the time from a level, `BLANK` or `UNDECODABLE` to another, until it is at rest."""
    settings = remove_missed_kicks(element.settings, element.pulse_corrections)
    if settings.holds_words:
        blank = blank_content(settings)
        present, target = (blank if content == BLANK else content for content in (present, target))
    elif present == UNDECODABLE:
        present = element.design.levels - 1
        if target != BLANK:
            return driving_time(element, present, BLANK) + driving_time(element, BLANK, target)
    moves = find_route(element.design, settings, present, target)
    ringing = moves[-1].ringing if moves else 0.0
    return sum(move.duration for move in moves) + settings.write.final_settle + ringing


def writing_time(element: Memory, present: int, target: int) -> float:
    """Return the time to drive the wall to a level, and to verify it."""
    driving = max(driving_time(element, present, target), expected_wait(element))
    return driving + element.reader.read_duration(element)


def estimate_write(element: Memory, level: int) -> float:
    """Return the time of a write; what is not known is read first."""
    if (present := find_content(element)) == UNDECODABLE:
        return 2.0 * element.reader.read_duration(element) + driving_time(element, BLANK, level)
    return writing_time(element, present, level)


def estimate_kick(element: Memory, speed: float) -> float:
    """Return the time of a kick by hand.

    Raises:
        Refused: The transducer cannot move the end from one phase to the other.
    """
    design, settings = element.design, element.settings
    stroke, longest = abs(design.D_s2 - design.D_s1), settings.transducer.max_stroke
    if stroke > longest:
        raise Refused(
            ErrorCode.UNSUPPORTED,
            'transducer.max_stroke',
            longest,
            f'at least {stroke:.3g}, the stroke of a kick',
        )
    return kick_duration(design, settings.kick, speed, settings.kick.settle)
