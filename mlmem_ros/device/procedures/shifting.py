# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Shifting: move every wall whose turn it is by one level, by half a cycle of strain.

Compression frees walls at every second level and kinks at the others, tension the rest. So walls
and kinks that take turns keep step, as in a shift register.
"""

from __future__ import annotations

from ..errors import ProcedureFailed
from ..instrument import Instrument
from ..memory import Memory
from ..motion import Cycle
from ..move_settings import peak
from ..moves import gentle, half_period
from ..reading import UNDECODABLE, Reading
from ..settings import Settings
from .blocks import Procedure, Result, play, return_to_zero
from .listening import listen, wait_for_quiet

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
