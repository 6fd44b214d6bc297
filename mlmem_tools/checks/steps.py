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
from mlmem.moves.strain_cycle import WriteSettings, correct_write, select_peak
from mlmem.physics import (
    Chain,
    Specimen,
    StateError,
    find_level,
    find_walls,
    stable_step,
    substep_times,
)
from mlmem.physics.equilibrium import find_pinned_wall

from .concern import MAX_CELL_STEPS, MIN_STEP_CELLS, Finding, Subject, Verdict


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
    dt = _choose_time_step(Specimen(dataclasses.replace(design, substrate='rigid')))
    time = cycle.duration + write.final_settle
    return len(subject.steps) * time / dt * max(design.N, MIN_STEP_CELLS)


def _choose_time_step(made: Specimen) -> float:
    """Return a stable time step of at most 1 time unit: with it, all shipped elements get the
    verdicts of a finer one.
    """
    return min(1.0, stable_step(made))


def _find_lost_levels(subject: Subject, compression: float, tension: float) -> list[int]:
    """Return the levels from which a step fails with the peaks multiplied by factors."""
    write = subject.settings.write
    write = dataclasses.replace(
        write, compression=compression * write.compression, tension=tension * write.tension
    )
    # every other one, as two steps in a row are simulated
    return [
        lost for start in subject.steps[::2] for lost in _simulate_steps(subject, write, start)
    ]


def _simulate_steps(subject: Subject, write: WriteSettings, start: int) -> Iterator[int]:
    """Simulate two steps up in a row, and yield the levels from which one fails.

    The cycles follow each other as in a write of the device, which rests `write.final_settle`
    longer after the last; then exactly one wall must be at rest, within a cell of its defect,
    where a write may end. Each step starts from the state after the previous cycle, before that
    rest.
    """
    # `rigidity` covers a soft substrate; here it would take a hundred times as long.
    design = dataclasses.replace(subject.design, substrate='rigid')
    made = dataclasses.replace(subject.made, design=design)
    rate = subject.settings.actuator.max_rate
    chain = Chain(made, _choose_time_step(made))
    try:
        chain.place(find_pinned_wall(made, start))
    except StateError:  # the level pins no wall
        yield start
        return
    levels = range(start, min(start + 2, design.levels - 1))
    for level in levels:
        own = write
        if subject.corrections:
            own = correct_write(write, subject.corrections[level + 1])
        peak = select_peak(own, design.is_freed_by_compression(level))
        cycle = Cycle.plan_cycle(own, peak, rate)
        times = substep_times(round(cycle.duration / chain.dt), chain.dt)
        try:
            chain.advance(cycle.strain(times) * design.end_displacement(1.0))
            state = chain.state()
            chain.advance_steps(round(write.final_settle / chain.dt))
        except StateError:  # driven so hard that the chain diverges
            yield from levels[level - start :]
            return
        found = find_walls(design, chain.configuration)
        alone = find_level(design, chain.configuration, math.inf) >= 0
        if not alone or abs(found[0].position - design.defect_site(level + 1)) >= 1.0:
            yield level
        chain.restore(state, V_N=0.0, steps_done=0)
