# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Writing: drive the wall to a level by the fastest moves, verify, and try again."""

from __future__ import annotations

from ..commands import Outcome
from ..errors import NotFollowed, ProcedureFailed
from ..instrument.blocks import Procedure
from ..memory import Memory
from ..moves.strain_cycle import return_to_zero
from ..readers.reading import UNDECODABLE, Reading, correct_speed
from . import estimates
from .driving import erase, go_to_level


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
        estimates.expect_duration(element, estimates.writing_time(element, present, level))
        try:
            plainly = strained and not settings.avoids_strain and 1 < attempt == attempts
            force = _peak_factor(element, attempt)
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
            reading = yield from element.reader.read(element)
            if element.reader.needs_second_read(reading):  # the wall has only just arrived
                reading = yield from element.reader.read(element)
        except ProcedureFailed as failure:
            raise ProcedureFailed(str(failure), attempt) from failure
        present = reading.level
        if present >= 0 and reading.level_margin < settings.min_margin:
            present = UNDECODABLE
        if present == level:
            return Outcome(reading, attempt)
        nudge *= correct_speed(element, reading, level, attempt)
        said = reading.reason or element.describe_content(reading.level)
        if present != reading.level:
            said = f'{said} with a margin of {reading.level_margin:.2f}'
        seen.append(said)
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


def _peak_factor(element: Memory, attempt: int) -> float:
    """Return the factor on the peak strains of an attempt, counted from 1."""
    settings = element.settings.write
    return float(min(settings.escalation ** (attempt - 1), settings.escalation_limit))
