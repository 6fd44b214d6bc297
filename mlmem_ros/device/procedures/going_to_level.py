# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Going to a level: take the wall to a level by the fastest moves, open loop."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ..errors import NotFollowed
from ..memory import Memory
from ..moves import How, Move, cycle_of, gentle, half_period, paper_way, route
from ..pulse_corrections import PulseCorrection, trimmed
from ..reading import BLANK, UNDECODABLE, describe_level
from ..settings import Settings
from .blocks import Procedure, kick, launch, play
from .erasing import erase, push_out
from .listening import wait_for_quiet


def go_to_level(
    element: Memory,
    present: int,
    level: int,
    force: float = 1.0,
    *,
    nudge: float = 1.0,
    plainly: bool = False,
    strained: bool = True,
    trims: Sequence[PulseCorrection] | None = None,
) -> Procedure[None]:
    """Drive the wall from the level that was read to another by the fastest moves, open loop.

    Args:
        force: Factor on the peak strains of steps up, within the actuator's limit.
        nudge: Factor on the speed of a kick, within the transducer's limit.
        plainly: Use only steps up and a kink, as in the paper.
        strained: Whether to use the actuator, if there is one.
        trims: PulseCorrections by the level to which a move goes; by default those learnt.

    Raises:
        ProcedureFailed: There is no way; `NotFollowed` if there is only one by strain, and the
            actuator does not follow.
    """
    design, settings = element.design, element.settings
    trims = element.calibration.pulses(settings) if trims is None else trims
    settings = paper_way(settings) if plainly else element.calibration.adapt(settings)
    if not strained:
        settings = replace(settings, actuator=replace(settings.actuator, present=False))
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
        last = move is moves[-1] and move.how is not How.LAUNCH
        try:
            yield from _strain(
                element, gentle(settings) if last else settings, move, trims[move.target], force
            )
        except NotFollowed as failure:
            needy = f'a {move.how.value} to {describe_level(move.target)} needs strain'
            raise NotFollowed(f'{needy}, and {failure}') from None
    yield from wait_for_quiet(element, settings.write.final_settle)


def _strain(
    element: Memory, settings: Settings, move: Move, trim: PulseCorrection, force: float
) -> Procedure[None]:
    """Make a move by strain."""
    design = element.design
    element.begin_cycle()
    if move.how is How.LAUNCH:
        yield from launch(element, trimmed(settings, trim).write, design.D_s2)
        return
    if move.how is How.STEP:
        settings = trimmed(settings, trim)
    elif move.how is How.STROKE:
        settings = element.calibration.adapt(settings, move.start)
    delay = half_period(design) if move.how is How.STEP and settings.write.shaped else 0.0
    yield from play(element, cycle_of(design, settings, move, force), delay)
