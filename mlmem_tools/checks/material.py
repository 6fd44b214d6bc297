# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The material: its two phases, gradient and time step; the bands of its waves, and which carriers
a wall reflects; the wall's width and energy.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from mlmem.instrument.drivers import steps_per_tick
from mlmem.instrument.end import End
from mlmem.physics import stable_step
from mlmem.physics.wall import wall_width
from mlmem.physics.waves import pass_band
from mlmem.settings import ProbeSettings

from .concern import Finding, Subject, Verdict, find_worst_verdict, grade_finding, judge_value


def check(subject: Subject) -> Iterator[Finding]:
    """Yield the findings on stiffnesses, gradient, levels, step, both carriers and the wall."""
    design = subject.design
    stiffer = max(design.k_s1, design.k_s2) / min(design.k_s1, design.k_s2)
    yield grade_finding(
        'stiffnesses',
        {'k_s1': design.k_s1, 'k_s2': design.k_s2},
        'k_r',
        # below 1.01 a wave sees no difference between the phases
        judge_value(stiffer, 1.01, 1.05),
        'the phases differ in stiffness, so a wall between them reflects waves',
        'the phases are the same to a wave, which passes through the wall without an echo: '
        'give the potential a cubic phase, b',
    )
    yield grade_finding(
        'gradient',
        {
            'first cell': subject.gradient_force_at(1.0),
            'last cell': subject.gradient_force_at(design.N),
        },
        'k_r cells',
        Verdict.PASS if design.gamma < 0.0 else Verdict.FAIL,
        'force that pulls a wall to the right between the defects, -gamma E / (2 alpha)',
        'nothing pulls a wall to the right, from level to level: gamma must be negative',
    )
    alpha, last = subject.made.alpha, 1.0 + design.gamma * design.N
    yield grade_finding(
        'alpha',
        {'first': float(alpha[0]), 'last': last, 'least': float(alpha.min())},
        '',
        # half of the potential should remain at the far end
        judge_value(min(last, 1.0 / last), 0.0, 0.5),
        'height of the potential along the element, relative to its start',
        'the potential changes so much along the element that pins, strains and bands differ '
        'between its ends: choose a smaller |gamma| or fewer cells',
    )
    alternate = design.J_s == 2 * design.J or design.levels == 1
    yield grade_finding(
        'levels',
        {'levels': design.levels, 'bits': design.bits, 'J_s / J': design.J_s / design.J},
        '',
        Verdict.PASS if alternate else Verdict.WARN,
        'two kinds of defect alternate: ahead of one the substrate stiffness has a maximum, ahead '
        'of the other a minimum',
        "the defects' phase in the substrate differs from level to level, so no strain "
        'moves a wall from all of them: choose J_s = 2 J',
    )
    yield _judge_step(subject)
    yield from _judge_carriers(subject)
    yield _judge_wall(subject)


def _judge_step(subject: Subject) -> Finding:
    time = subject.settings.time
    return Finding(
        'step',
        {
            'dt': time.tick / steps_per_tick(subject.made, time),
            'stable up to': stable_step(subject.made),
        },
        'time',
        Verdict.PASS,
        'step of the time integration; the device keeps it below the limit',
    )


Window = tuple[float, float]
"""Lowest and highest angular frequency."""


def _judge_carriers(subject: Subject) -> Iterator[Finding]:
    design, settings = subject.design, subject.settings
    low, high = float(subject.made.alpha.min()), float(subject.made.alpha.max())
    # A carrier must propagate in its own phase all along the way, wherever the wall is.
    whole_1 = pass_band(design.k_s1 * high)[0], pass_band(design.k_s1 * low)[1]
    whole_2 = pass_band(design.k_s2 * high)[0], pass_band(design.k_s2 * low)[1]
    alone = max(whole_2[0], pass_band(design.k_s1 * high)[1]), whole_2[1]
    yield _judge_carrier(End.LEFT, settings.probe, whole_2, alone, whole_1)
    alone = whole_1[0], min(whole_1[1], pass_band(design.k_s2 * low)[0])
    yield _judge_carrier(End.RIGHT, settings.probe_right, whole_1, alone, whole_2)


def _judge_carrier(
    end: End, probe: ProbeSettings, own: Window, alone: Window, others: Window
) -> Finding:
    """Judge a carrier by three windows: its `own` band, the part `alone`, the other phase's."""
    omega, sigma = probe.omega_c, probe.sigma
    share, clear = _energy_share(omega, sigma, own), _energy_share(omega, sigma, alone)
    phase, other = ('s2', 's1') if end is End.LEFT else ('s1', 's2')
    inside = _is_inside(omega, own)
    where = f'the band of {phase}, {own[0]:.4g} to {own[1]:.4g}'
    verdict = Verdict.WARN
    if share < 0.02:  # below this share of energy in the band nothing propagates
        verdict = Verdict.FAIL
        place = f'in the band of {other} alone' if _is_inside(omega, others) else 'in neither band'
        text = f'{omega:g} is {place} and does not propagate: choose one inside {where}'
        if inside:  # a pulse so short that its spectrum is everywhere
            text = f'hardly any of the pulse is within {where}: choose a larger sigma'
    elif not inside:
        text = f'{omega:g} is outside {where}: only the edge of the pulse propagates'
    # enough for a clear echo, even if the carrier is just within the other band, by a quarter of
    # its bandwidth
    elif not (_is_inside(omega, alone, 0.25 / sigma) and clear >= 0.2):
        text = f'{omega:g} also propagates in {other}, so the wall reflects only part of it'
    else:
        verdict = Verdict.PASS
        text = f'{omega:g} propagates in {phase}, and enough of it not in {other} to be reflected'
    return Finding(
        f'carrier_{end}',
        {'carrier': omega, 'usable from': alone[0], 'usable to': alone[1]},
        'rad/time',
        verdict,
        f'{text}; {share:.0%} of the pulse propagates, {clear:.0%} in {phase} alone',
    )


def _is_inside(omega: float, window: Window, tolerance: float = 0.0) -> bool:
    return window[0] - tolerance < omega < window[1] + tolerance


def _energy_share(omega: float, sigma: float, window: Window) -> float:
    """Return the fraction of a Gaussian pulse's energy in a window; 0 for an empty one."""
    low, high = (math.erf(sigma * (edge - omega)) for edge in window)
    return max(0.0, 0.5 * (high - low))


def _judge_wall(subject: Subject) -> Finding:
    width, J = wall_width(subject.design), subject.design.J
    min_wall_width = 2.0  # width in cells below which the lattice itself pins a wall
    return grade_finding(
        'wall_width',
        {'width': width, 'J': J},
        'cells',
        find_worst_verdict(
            (judge_value(width, min_wall_width, min_wall_width), judge_value(J / width, 1.0, 1.25))
        ),
        'the wall spans several cells, and fits between two defects',
        'the wall is as narrow as the lattice spacing, so the lattice pins it anywhere: choose a '
        'smaller d'
        if width < min_wall_width
        else 'the wall is as wide as a level, so it feels two defects at once: choose a greater J '
        'or d',
    )
