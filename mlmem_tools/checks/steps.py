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
from mlmem.physics import Specimen, StateError, stable_step
from mlmem_ros.host.design_check import Verdict

from .bare import COARSE, departures, scaled
from .concern import LEAST_CELLS, MOST_WORK, Finding, Subject

ROW = 2
"""Steps in a row."""

OFF = 0.15
"""How far off both peaks may be at once; an operating point nearer to failure gets a warning."""

SOURCE = (
    'upon recovery of the zero strain condition, the transition wave becomes pinned at a soft '
    'defect site different from the one from which it originated (p. 5)'
)


def check(subject: Subject) -> Iterator[Finding]:
    """Yield the finding on the steps of a write."""
    if not subject.steps:
        return
    corners = list(itertools.product((1.0 - OFF, 1.0 + OFF), repeat=2))
    if (1 + len(corners)) * _work(subject) > MOST_WORK:
        text = 'the steps take too long to simulate in a check: choose shorter times (write.*)'
        yield Finding('write_steps', {}, '', Verdict.WARN, text, SOURCE)
        return
    own = _lost(subject, 1.0, 1.0)
    off = [] if own else [corner for corner in corners if _lost(subject, *corner)]
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
            '(compression and tension): `mlmem margins` shows how far off they may be'
        )
    else:
        verdict = Verdict.PASS
        text = f'the steps succeed, even with both peaks {OFF:.0%} off'
    values = {
        'steps': float(len(subject.steps)),
        'lost': float(len(own)),
        'peaks tried': 1.0 if own else 1.0 + len(corners),
        'peaks failed': float(bool(own) or len(off)),
    }
    yield Finding('write_steps', values, '', verdict, text, SOURCE)


def _work(subject: Subject) -> float:
    """Return the cell steps for making all steps once."""
    design, write = subject.design, subject.settings.write
    cycle = Cycle.planned(write, write.tension, subject.settings.actuator.max_rate)
    dt = min(COARSE, stable_step(Specimen(dataclasses.replace(design, substrate='rigid'))))
    time = cycle.duration + write.final_settle
    return len(subject.steps) * time / dt * max(design.N, LEAST_CELLS)


def _lost(subject: Subject, compression: float, tension: float) -> list[int]:
    """Return the levels from which a step fails with the peaks multiplied by factors."""
    # `rigidity` covers a soft substrate; here it would take a hundred times as long.
    design = dataclasses.replace(subject.design, substrate='rigid')
    made = dataclasses.replace(subject.made, design=design)
    write = scaled(subject.settings.write, compression, tension)
    rate = subject.settings.actuator.max_rate
    lost = []
    for start in subject.steps[::ROW]:
        goal = min(start + ROW, design.levels - 1)
        try:
            away = list(departures(
                made, write, start, goal, max_rate=rate, dt=COARSE, corrections=subject.corrections
            ))  # fmt: skip
        except StateError:  # the level pins no wall
            away = [math.inf]
        lost += [start + step for step, cells in enumerate(away) if cells >= 1.0]
    return lost
