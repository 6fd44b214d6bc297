# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Steps of a write, simulated from sampled levels: two in a row, as ringing decides the second.

The closed forms of the schedule hold for slow ramps. A fast write depends on inertia and damping,
and simulating a step of the bare chain takes milliseconds.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Iterator

from mlmem.instrument.motion import Cycle
from mlmem.physics import NOH_BATHE, Specimen, StateError, stable_step
from mlmem_ros.host.design_check import Verdict

from .bare import COARSE_TIME_STEP, measure_departures, scale_peaks
from .concern import MAX_CELL_STEPS, MIN_STEP_CELLS, Finding, Subject


def check(subject: Subject) -> Iterator[Finding]:
    """Yield the finding on the steps of a write."""
    if not subject.steps:
        return
    # how far off both peaks may be at once; an operating point nearer to failure gets a warning
    peak_deviation = 0.15
    corners = list(itertools.product((1.0 - peak_deviation, 1.0 + peak_deviation), repeat=2))
    if (1 + len(corners)) * _estimate_work(subject) > MAX_CELL_STEPS:
        text = 'the steps take too long to simulate in a check: choose shorter times (write.*)'
        yield Finding('write_steps', {}, '', Verdict.WARN, text)
        return
    own = _find_lost_levels(subject, 1.0, 1.0)
    off = [] if own else [corner for corner in corners if _find_lost_levels(subject, *corner)]
    if own:
        verdict = Verdict.FAIL
        text = (
            f'a write upward does not take the wall from level {own[0]} to the next: choose '
            'greater peaks, longer times or more damping'
        )
    elif off:
        verdict = Verdict.WARN
        names = ', '.join(f'{c:.2f} and {t:.2f}' for c, t in off)
        text = (
            f'the steps succeed, but not with the peaks at {names} times their values '
            '(compression and tension)'
        )
    else:
        verdict = Verdict.PASS
        text = f'the steps succeed, even with both peaks {peak_deviation:.0%} off'
    values = {
        'steps': float(len(subject.steps)),
        'lost': float(len(own)),
        'peaks tried': 1.0 if own else 1.0 + len(corners),
        'peaks failed': float(bool(own) or len(off)),
    }
    yield Finding('write_steps', values, '', verdict, text)


def _estimate_work(subject: Subject) -> float:
    """Return the cell steps for making all steps once."""
    design, write = subject.design, subject.settings.write
    cycle = Cycle.plan_cycle(write, write.tension, subject.settings.actuator.max_rate)
    dt = min(
        COARSE_TIME_STEP,
        stable_step(Specimen(dataclasses.replace(design, substrate='rigid')), NOH_BATHE),
    )
    time = cycle.duration + write.final_settle
    return len(subject.steps) * time / dt * max(design.N, MIN_STEP_CELLS)


def _find_lost_levels(subject: Subject, compression: float, tension: float) -> list[int]:
    """Return the levels from which a step fails with the peaks multiplied by factors."""
    # `rigidity` covers a soft substrate; here it would take a hundred times as long.
    design = dataclasses.replace(subject.design, substrate='rigid')
    made = dataclasses.replace(subject.made, design=design)
    write = scale_peaks(subject.settings.write, compression, tension)
    rate = subject.settings.actuator.max_rate
    lost = []
    steps_in_row = 2  # steps in a row
    for start in subject.steps[::steps_in_row]:
        goal = min(start + steps_in_row, design.levels - 1)
        try:
            away = list(
                measure_departures(
                    made,
                    write,
                    start,
                    goal,
                    max_rate=rate,
                    dt=COARSE_TIME_STEP,
                    corrections=subject.corrections,
                )
            )
        except StateError:  # the level pins no wall
            away = [math.inf]
        lost += [start + step for step, cells in enumerate(away) if cells >= 1.0]
    return lost
