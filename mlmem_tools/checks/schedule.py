# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The strain cycles: peaks, ramps and durations."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace

from mlmem.errors import ProcedureFailed
from mlmem.instrument.echo import listening_time
from mlmem.instrument.end import End
from mlmem.instrument.motion import Cycle
from mlmem.moves.move import find_route
from mlmem.moves.strain_cycle import EraseSettings, WriteSettings
from mlmem.readers.reading import BLANK
from mlmem.settings import RegisterSettings

from .concern import Finding, Subject, Verdict, grade_finding, judge_value


def check(subject: Subject) -> Iterator[Finding]:
    """Yield the findings on peaks of write and erase, and durations."""
    walls = subject.forward(kink=False)
    if subject.settings.actuator.present:
        yield _judge_peaks(subject, 'write', walls)
        yield _judge_peaks(subject, 'erase', subject.forward(kink=True))
        yield _judge_wall_hold(subject, walls)
    yield _judge_durations(subject)


def _judge_peaks(subject: Subject, name: str, frees: dict[int, float]) -> Finding:
    settings: WriteSettings | EraseSettings = getattr(subject.settings, name)
    values: dict[str, float] = {}
    margins = []
    for mode, peak in (('compression', settings.compression), ('tension', settings.tension)):
        needed = [abs(e) for e in frees.values() if e * peak > 0.0]  # not for NaN
        if needed:
            hardest = max(needed)
            values[f'{mode} needed'] = math.copysign(hardest, peak)
            values[f'{mode} peak'] = peak
            margins.append(abs(peak) / hardest)
    held = [level for level, strain in frees.items() if math.isnan(strain)]
    ratio = math.nan if held else min(margins, default=math.inf)
    verdict = judge_value(ratio, 1.0, 1.1)  # a tenth more leaves a margin for scatter
    mover = 'wall' if name == 'write' else 'kink'
    if held:
        text = f'no strain frees the {mover} from level {held[0]}: choose a smaller |beta|'
    elif not margins:
        text = 'a single level: there are no steps'
    elif verdict is Verdict.PASS:
        text = f'the peaks free the {mover} from every level, with {ratio - 1:.0%} to spare'
    elif verdict is Verdict.FAIL and settings.ramp * subject.design.eta < 1.0:
        verdict = Verdict.WARN  # in so fast a ramp the inertia of the cells also pushes the wall
        text = (
            f'a peak is at {ratio:.0%} of what frees the {mover} in a slow ramp; only a '
            'simulation shows whether a fast one does'
            f'{" (`write_steps`)" if name == "write" else ""}'
        )
    else:
        text = f'a peak is at {ratio:.0%} of what frees the {mover}: choose greater peaks'
    return Finding(f'{name}_peaks', values, 'strain', verdict, text)


def _judge_wall_hold(subject: Subject, frees: dict[int, float]) -> Finding:
    tension = subject.settings.erase.tension
    limit = min((strain for strain in frees.values() if strain > 0.0), default=math.inf)
    return grade_finding(
        'erase_order',
        {'erase tension': tension, 'frees the wall': limit},
        'strain',
        judge_value(limit / tension, 0.0, 1.1),  # the same margin for scatter
        'the tension that moves the kink leaves the wall in place, so the kink catches up',
        'the tension that moves the kink also moves the wall, which runs away from it: choose a '
        'smaller erase.tension',
    )


def _judge_durations(subject: Subject) -> Finding:
    """Report how long a step, a read, the longest write upward and the longest erase take; fail
    where without an actuator a level is out of reach.
    """
    design = subject.design
    # in which a register holds one wall at its levels
    settings = replace(subject.settings, register=RegisterSettings())
    unit, top = settings.scale.time, design.levels - 1
    read = listening_time(design, settings.probe, End.LEFT)
    look = listening_time(design, settings.probe_right, End.RIGHT)
    peak = max(-settings.write.compression, settings.write.tension)
    step = Cycle.plan_cycle(settings.write, peak, settings.actuator.max_rate).duration
    values = {'step': step, 'read': read}
    try:
        reached = set[int]()
        with suppress(ProcedureFailed):
            reached = {move.target for move in find_route(design, settings, BLANK, top)}
        for level in sorted(set(range(design.levels)) - reached):
            find_route(design, settings, BLANK, level)  # it says why there is none
        for name, start, target, heard in (
            ('write 0 to top', 0, top, read),
            ('erase from top', top, BLANK, look),
        ):
            way = find_route(design, settings, start, target)
            values[name] = sum(move.duration for move in way) + heard
    except ProcedureFailed as error:
        return Finding('durations', values, 'time', Verdict.FAIL, str(error))
    seconds = ', '.join(f'{name} {value * unit:.3g} s' for name, value in values.items())
    return Finding(
        'durations', values, 'time', Verdict.PASS, f'in robot time: {seconds}',
    )  # fmt: skip
