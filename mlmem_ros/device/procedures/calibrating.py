# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Calibrating: learn the echo delay of every level, and which pulse takes the wall there."""

from __future__ import annotations

from dataclasses import replace

from ..calibration import Calibration, DelayTable
from ..decoding import primary
from ..end import End
from ..errors import ProcedureFailed, SettingsError
from ..memory import Memory
from ..pulse_corrections import kicked
from ..reading import BLANK, Reading
from .blocks import Procedure, Result, return_to_zero
from .climbing import climb
from .erasing import erase
from .listening import listen
from .writing import restore, write


def calibrate(element: Memory) -> Procedure[Result]:
    """Learn the delay of every level from both ends, and restore the content in any case.

    Every new delay must be nearest to that of the same level in the present calibration, because a
    failed step would shift all levels of the table by one. Such a step is repeated with up to
    `write.pulses` other pulses, and the one that works is learnt too. A twin's forecast takes the
    place of the present calibration, if there is one. An element with many walls, or known bad
    cells, learns nothing: a wall at every level must be heard as forecast.

    Raises:
        ProcedureFailed: The wall did not follow, or the delays do not distinguish the levels (the
            old calibration is kept), or the content could not be restored.
    """
    yield from return_to_zero(element)
    if element.waveforms is not None:
        return (yield from _verify(element))
    content, known = (yield from listen(element)), element.calibration
    try:
        element.calibration = yield from _learn(element)
    except ProcedureFailed as failure:
        element.calibration = known
        try:
            yield from restore(element, content)
        except ProcedureFailed as lost:
            raise ProcedureFailed(f'{failure}; nor was the content restored: {lost}') from failure
        raise
    restored = yield from restore(element, content)
    learnt = element.calibration
    return replace(restored, delays={end: learnt.table(end).delays for end in learnt.ends})


def _verify(element: Memory) -> Procedure[Result]:
    """Write one wall to every level that can be used: what is heard is as forecast."""
    content = yield from listen(element)
    for word in element.register.code.each if element.register else element.levels:
        yield from write(element, word)
    return (yield from restore(element, content))


def _climb_all(element: Memory) -> Procedure[dict[int, Reading]]:
    """Take the wall from blank to every level, and return the readings."""
    top, place, heard = element.design.levels - 1, BLANK, dict[int, Reading]()
    stops = [level for level in range(top) if kicked(element.settings, level)]
    for level in (*stops, top):
        heard |= yield from climb(element, place, level)
        place = level
    return heard


def _learn(element: Memory) -> Procedure[Calibration]:
    """Erase, step through all levels, and return the new calibration."""
    element.calibration = element.forecast or element.calibration
    empty = (yield from erase(element)).reading
    blank = empty.delay if empty else None
    try:
        heard = yield from _climb_all(element)
        levels = [heard[level] for level in range(element.design.levels)]
        right = DelayTable(
            tuple(each.right_delay or 0.0 for each in levels),
            blank,
            tuple(each.shapes[End.RIGHT] for each in levels),
        )
        learnt = replace(element.calibration, right=right)
        if learnt.left is not None:
            left = DelayTable(
                tuple(each.left_delay or 0.0 for each in levels),
                shapes=tuple(each.shapes[End.LEFT] for each in levels),
            )
            learnt = replace(learnt, left=left)
        learnt.check(element.design.levels, primary(element.settings.read))
    except (ProcedureFailed, SettingsError) as error:
        raise ProcedureFailed(f'the calibration was not taken: {error}') from error
    return learnt
