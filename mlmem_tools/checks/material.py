# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The material: its two phases, its gradient, its time step."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mlmem_ros.device.drivers import steps_per_tick
from mlmem_ros.host.design_check import Verdict
from mlmem_ros.physics import CASE_II, INTEGRATORS, stable_step

from .concern import Finding, Subject, graded, judged

DISTINCT = 1.05
"""Least ratio of the phases' stiffnesses: below 1.01 a wave sees no difference."""

LEAST_ALPHA = 0.5
"""Fraction of the potential that should remain at the far end."""

LARGEST_OWN_DAMPING = 0.65
"""Fraction of eta up to which the integrator's numerical damping of the carrier is small."""


def check(subject: Subject) -> Iterator[Finding]:
    """Yield the findings on ground states, stiffnesses, gradient, levels and step."""
    design = subject.design
    yield Finding(
        'ground_states',
        {'s1': design.D_s1, 's2': design.D_s2, 'barrier': design.D_barrier},
        'cells',
        Verdict.PASS,
        'configurations of the blank and the active phase, and the barrier between them',
        'psi possesses n >= 2 degenerate ground states, supporting the formation of a '
        '(anti-)kink (p. 2)',
    )
    stiffer = max(design.k_s1, design.k_s2) / min(design.k_s1, design.k_s2)
    yield graded(
        'stiffnesses',
        {'k_s1': design.k_s1, 'k_s2': design.k_s2},
        'k_r',
        judged(stiffer, 1.01, DISTINCT),
        'the phases differ in stiffness, so a wall between them reflects waves',
        'the phases are the same to a wave, which passes through the wall without an echo: '
        'give the potential a cubic phase, b',
        'the linear on-site stiffness about each ground state is unique (p. 2)',
    )
    yield graded(
        'gradient',
        {'force': subject.gradient_force},
        'k_r cells',
        Verdict.PASS if design.gamma < 0.0 else Verdict.FAIL,
        'force that pulls a wall to the right between the defects, -gamma E / 2',
        'nothing pulls a wall to the right, from level to level: gamma must be negative',
        'the monotonic variation supports the uni-directional propagation of both kink and '
        'anti-kink (p. 2)',
    )
    alpha, last = subject.made.alpha, 1.0 + design.gamma * design.N
    yield graded(
        'alpha',
        {'first': float(alpha[0]), 'last': last, 'least': float(alpha.min())},
        '',
        judged(min(last, 1.0 / last), 0.0, LEAST_ALPHA),
        'height of the potential along the element, relative to its start',
        'the potential changes so much along the element that pins, strains and bands differ '
        'between its ends: choose a smaller |gamma| or fewer cells',
        'both gamma and beta are kept small, and the size of the system does not result in a '
        'large discrepancy between k_si at each boundary (p. 4)',
    )
    alternate = design.J_s == 2 * design.J or design.levels == 1
    yield graded(
        'levels',
        {'levels': design.levels, 'bits': design.bits, 'J_s / J': design.J_s / design.J},
        '',
        Verdict.PASS if alternate else Verdict.WARN,
        'two kinds of defect alternate: ahead of one the substrate stiffness has a maximum, ahead '
        'of the other a minimum',
        "the defects' phase in the substrate differs from level to level, so no strain "
        'moves a wall from all of them: choose J_s = 2 J',
        'the soft defects divide the system into p levels of J unit cells, m = floor(log2 p) '
        '(p. 2)',
    )
    yield _step(subject)


def _step(subject: Subject) -> Finding:
    design, settings = subject.design, subject.settings
    integrator = INTEGRATORS[settings.time.integrator]
    dt = settings.time.tick / steps_per_tick(subject.made, settings.time)
    carriers = np.array([settings.probe.omega_c, settings.probe_right.omega_c])
    ideal, seen = (integrator.squared_frequency(carriers, design.eta, each) for each in (0.0, dt))
    own = float(((ideal - seen).imag / carriers).max())
    little = own < LARGEST_OWN_DAMPING * max(design.eta, CASE_II.eta)
    return graded(
        'step',
        {'dt': dt, 'stable up to': stable_step(subject.made, integrator), 'own damping': own},
        'time',
        Verdict.PASS if little else Verdict.WARN,
        'step of the time integration; the device keeps it below the limit',
        f'the integrator damps the carrier by {own:.2g}, compared with an eta of '
        f'{design.eta:.2g}: set time.integrator to pefrl',
        'we apply the Noh-Bathe integration scheme to Eqs. (1) (p. 5)',
    )
