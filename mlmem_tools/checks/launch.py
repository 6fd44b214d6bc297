# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The launch of a wall and of a kink, simulated on the first cells alone.

An incoming wall swings in the trap that the strain makes, and escapes through the free end if the
trap is too near to it or too shallow. No equilibrium shows that; a simulation of a few levels
does, in milliseconds.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator

from mlmem.element import MemoryElement
from mlmem.instrument.blocks import run
from mlmem.instrument.drivers import Simulation
from mlmem.instrument.motion import Cycle
from mlmem.moves.strain_cycle import EraseSettings, WriteSettings, correct_write, launch_wall
from mlmem.physics import StateError, find_walls
from mlmem.readers.calibration import Calibration, DelayTable
from mlmem.settings import RegisterSettings

from .concern import MAX_CELL_STEPS, MIN_STEP_CELLS, Finding, Subject, Verdict
from .excerpt import cut_excerpt


def check(subject: Subject) -> Iterator[Finding]:
    """Yield the findings on the launches of a write and of an erase."""
    for name in ('write', 'erase'):
        yield _judge_launch(subject, name, simulate_launch(subject, name))


def simulate_launch(subject: Subject, name: str) -> float | None:
    """Return where the wall of a 'write' or the kink of an 'erase' comes to rest.

    Returns:
        Site of the wall; NaN unless exactly one remains; None if the simulation would take too
        long.
    """
    design, settings = subject.design, subject.settings
    # four levels at the left end
    few = cut_excerpt(subject.made, 1.0, min(4 * design.J, design.N)).made
    part = dataclasses.replace(few.design, substrate='rigid')
    few = dataclasses.replace(few, design=part)
    if name == 'write' and subject.corrections:
        write, limit = settings.write, settings.actuator.max_strain
        write = correct_write(write, subject.corrections[0], limit)
        settings = dataclasses.replace(settings, write=write)
    group: WriteSettings | EraseSettings = getattr(settings, name)
    # The strain of the first cells when the whole element has that of the settings.
    local = design.end_displacement(1.0) * subject.made.strain_shape[part.N - 1] / part.N
    reached = abs(group.start_strain * local)
    if reached > 0.5:  # no actuator reaches this strain
        return math.nan
    actuator = dataclasses.replace(
        settings.actuator, max_strain=max(settings.actuator.max_strain, reached)
    )
    unknown = DelayTable(tuple(range(part.levels)))
    element = MemoryElement(
        part, dataclasses.replace(settings, actuator=actuator, register=RegisterSettings()),
        Calibration(unknown, unknown),
        Simulation.build_blank(few, settings.time),
    )  # fmt: skip
    # in cell steps; the overhead of a tick is worth 6e4 of them
    tick_cost = element.steps_per_tick * max(part.N, MIN_STEP_CELLS) + 6e4
    cycle = Cycle.plan_cycle(group, group.start_strain, settings.actuator.max_rate)
    move = (part.D_s2 - part.D_s1) / group.launch_speed
    if (cycle.duration + move) / element.tick * tick_cost > MAX_CELL_STEPS:
        return None
    phases = part.D_s1, part.D_s2
    start, target = phases if name == 'write' else phases[::-1]
    strained = dataclasses.replace(group, start_strain=group.start_strain * local)
    element.chain.place(start + few.offsets)
    try:
        run(element, launch_wall(element, strained, target))
    except StateError:
        return math.nan
    found = find_walls(part, element.chain.configuration)
    return found[0].position if len(found) == 1 else math.nan


def _judge_launch(subject: Subject, name: str, position: float | None) -> Finding:
    values = {'level 0': float(subject.design.defect_site(0))}
    verdict, mover = (Verdict.FAIL, 'wall') if name == 'write' else (Verdict.WARN, 'kink')
    advice = f'choose another {name}.start_strain or a slower {name}.launch_speed'
    if position is None:
        verdict = Verdict.WARN
        text = f'a launch takes too long to simulate in a check: choose shorter times ({name}.*)'
    elif math.isnan(position):
        text = (
            f'no {mover} remains: it does not stay in the trap that the strain makes near the '
            f'free end; {advice}, or set level 0 farther from the end'
        )
    elif abs(position - values['level 0']) > 1.0:  # within one cell the wall is at the defect
        text = f'the {mover} comes to rest somewhere other than level 0: {advice}'
    else:
        verdict, text = Verdict.PASS, f'a launched {mover} comes to rest at level 0'
    return Finding(
        f'launch_{name}',
        values if position is None else {'rests at': position, **values},
        'cells',
        verdict,
        text,
    )
