# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Writing: step the wall up to a level, or erase and start again; verify, and try harder."""

from __future__ import annotations

from ..errors import ProcedureFailed
from ..memory import Memory
from ..motion import Cycle
from ..reading import BLANK, UNDECODABLE, Reading, describe_level
from ..settings import peak
from .blocks import Procedure, Result, launch, play, slacken, wait
from .erasing import erase
from .listening import look


def write(element: Memory, level: int) -> Procedure[Result]:
    """Write a level: step up to it, or erase and start again; then verify by reading.

    What the reading says is where the next try goes on from, with peak strains that are
    `write.escalation` times greater: a wall that did not follow was not pulled hard enough. A
    wall that stopped on its way is nearest to the level that was asked for, too, but no later
    step finds it in its place: with less than `write.min_margin` it is written anew.

    Raises:
        ProcedureFailed: The level was not reached within `write.attempts`.
    """
    attempts, least = element.settings.write.attempts, element.settings.write.min_margin
    yield from slacken(element)
    reading = element.reading
    if reading is None or reading.level == UNDECODABLE:
        reading = yield from look(element)
    present, seen = reading.level, []
    for attempt in range(1, attempts + 1):
        try:
            yield from drive(element, present, level, _force(element, attempt))
            reading = yield from look(element)
        except ProcedureFailed as failure:
            raise ProcedureFailed(str(failure), attempt) from failure
        present, said = reading.level, describe_level(reading.level)
        if present == level:
            if reading.level_margin >= least:
                return Result(reading, attempt)
            present, said = UNDECODABLE, f'{said} with a margin of {reading.level_margin:.2f}'
        seen.append(said)
    raise ProcedureFailed(
        f'level {level} was not reached in {attempts} attempts; read instead: {", ".join(seen)}',
        attempts,
    )


def restore(element: Memory, content: Reading) -> Procedure[Result]:
    """Write what a reading said, or erase where it said blank.

    Raises:
        ProcedureFailed: It cannot be brought back.
    """
    if content.level >= 0:
        return (yield from write(element, content.level))
    return (yield from erase(element))


def _force(element: Memory, attempt: int) -> float:
    """Return the factor on the peak strains of a try, the first being 1."""
    settings = element.settings.write
    return float(min(settings.escalation ** (attempt - 1), settings.escalation_limit))


def drive(element: Memory, present: int, level: int, force: float = 1.0) -> Procedure[None]:
    """Drive the wall from the level that was read to another, without looking.

    Args:
        element: The device.
        present: The level that was read, `BLANK` or `UNDECODABLE`.
        level: Where to.
        force: Factor on the peak strains, as far as the actuator goes.
    """
    settings = element.settings.write
    limit = element.settings.actuator.max_strain
    if present == UNDECODABLE or present > level:
        yield from erase(element)
        present = BLANK
    if present == BLANK:
        element.begin_cycle()
        yield from launch(element, settings, element.design.D_s2)
        present = 0
    for step in range(present, level):
        element.begin_cycle()
        wanted = force * peak(settings, element.design.freed_by_compression(step))
        yield from play(element, Cycle.planned(settings, max(-limit, min(wanted, limit))))
    yield from wait(element, settings.final_settle)
