# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Going to a level: take the wall to a level by the fastest moves, open loop."""

from __future__ import annotations

from collections.abc import Sequence

from ..memory import Memory
from ..moves import How, cycle_of, gentle, half_period, paper_way, route
from ..reading import BLANK, UNDECODABLE
from ..trims import Trim, trimmed
from .blocks import Procedure, kick, launch, play
from .erasing import erase, push_out
from .listening import settle


def go_to_level(
    element: Memory,
    present: int,
    level: int,
    force: float = 1.0,
    *,
    nudge: float = 1.0,
    plainly: bool = False,
    trims: Sequence[Trim] | None = None,
) -> Procedure[None]:
    """Drive the wall from the level that was read to another by the fastest moves, open loop.

    Args:
        element: The element.
        present: The level that was read, `BLANK` or `UNDECODABLE`.
        level: The target level.
        force: Factor on the peak strains of steps up, within the actuator's limit.
        nudge: Factor on the speed of a kick, within the transducer's limit.
        plainly: Use only steps up and a kink, as in the paper.
        trims: Trims by the level to which a move goes; by default those learnt.
    """
    design, settings = element.design, element.settings
    trims = element.calibration.pulses(settings) if trims is None else trims
    settings = paper_way(settings) if plainly else element.calibration.adapt(settings)
    if present == UNDECODABLE:
        yield from erase(element, plainly=plainly)
        present = BLANK
    moves = route(design, settings, present, level)
    for move in moves:
        if move.how is How.PUSH:
            yield from push_out(element)
            nudge *= settings.push.after
            continue
        if move.how is How.KICK:
            yield from kick(element, move.target, trims[move.target].speed * nudge)
            continue
        if move.how is How.ERASE:
            yield from erase(element, plainly=plainly)
            continue
        element.begin_cycle()
        if move.how is How.LAUNCH:
            given = trimmed(settings, trims[move.target])
            yield from launch(element, given.write, design.D_s2)
            continue
        given = gentle(settings) if move is moves[-1] else settings
        if move.how is How.STEP:
            given = trimmed(given, trims[move.target])
        elif move.how is How.STROKE:
            given = element.calibration.adapt(given, move.start)
        delay = half_period(design) if move.how is How.STEP and settings.write.shaped else 0.0
        yield from play(element, cycle_of(design, given, move, force), delay)
    yield from settle(element, settings.write.final_settle)
