# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Calibrating: learn what every level sounds like from either end."""

from __future__ import annotations

from dataclasses import replace

from ..calibration import Calibration, DelayTable
from ..end import End
from ..errors import ProcedureFailed, SettingsError
from ..memory import Memory
from ..reading import BLANK, describe_level
from . import foreseen
from .blocks import Procedure, Result, slacken
from .erasing import erase
from .listening import look, probe
from .writing import drive, restore


def calibrate(element: Memory) -> Procedure[Result]:
    """Learn the delay of every level from both ends, and restore the content in any case.

    Every new delay has to be nearest to that of its own level in the present calibration: a
    step that failed would give a table whose levels are all one off.

    Raises:
        ProcedureFailed: The wall did not follow or the delays do not tell the levels apart
            (the old calibration is kept), or the content could not be restored.
    """
    foreseen.expect(element, foreseen.everything(element))
    yield from slacken(element)
    content = yield from look(element)
    try:
        element.calibration = yield from _learn(element)
    except ProcedureFailed as failure:
        try:
            yield from restore(element, content)
        except ProcedureFailed as lost:
            raise ProcedureFailed(f'{failure}; nor is the content restored: {lost}') from failure
        raise
    restored = yield from restore(element, content)
    learnt = element.calibration
    return replace(restored, delays={end: learnt.table(end).delays for end in learnt.ends})


def _learn(element: Memory) -> Procedure[Calibration]:
    """Erase, step through all levels, and return what they sound like."""
    empty = (yield from erase(element)).reading
    delays: dict[End, list[float]] = {end: [] for end in element.calibration.ends}
    for level in range(element.design.levels):
        yield from drive(element, level - 1 if level else BLANK, level)
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
    blank = empty.delay if empty else None
    try:
        left = DelayTable(tuple(delays[End.LEFT])) if End.LEFT in delays else None
        return Calibration(left, DelayTable(tuple(delays[End.RIGHT]), blank))
    except SettingsError as error:
        raise ProcedureFailed(f'the calibration was not taken: {error}') from error
