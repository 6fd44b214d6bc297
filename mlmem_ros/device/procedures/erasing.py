# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Erasing: a kink is driven across until it meets the wall."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..errors import ProcedureFailed
from ..reading import BLANK, describe_level
from .blocks import Procedure, Result, bring_back, cycle, launch, slacken
from .listening import probe

if TYPE_CHECKING:
    from ..element import MemoryElement


LOOK_SPACING = 8
"""An erase looks after every cycle at first, then after an eighth more each time: a look takes as
long as a cycle or longer, and the kink needs about as many cycles as the wall's level."""


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
        if kink % max(1, kink // LOOK_SPACING) == 0:
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
