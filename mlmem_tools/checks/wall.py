# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The wall: its width and its energy."""

from __future__ import annotations

from collections.abc import Iterator

from mlmem_ros.host.design_check import Verdict, worst

from .concern import Finding, Subject, graded, judged

NARROW = 2.0
"""Width in cells below which the lattice itself pins a wall."""


def check(subject: Subject) -> Iterator[Finding]:
    """Yield the findings on width and energy."""
    width, J = subject.wall_width, subject.design.J
    yield graded(
        'wall_width',
        {'width': width, 'J': J},
        'cells',
        worst((judged(width, NARROW, NARROW), judged(J / width, 1.0, 1.25))),
        'the wall spans several cells, and fits between two defects',
        'the wall is as narrow as the lattice spacing, so the lattice pins it anywhere: choose a '
        'smaller d'
        if width < NARROW
        else 'the wall is as wide as a level, so it feels two defects at once: choose a greater J '
        'or d',
        'transition wavefronts separating domains of opposing ground states (Fig. 1c)',
    )
    yield Finding(
        'wall_energy',
        {'energy': subject.wall_energy},
        'k_r cells^2',
        Verdict.PASS,
        'energy of a wall at the start of the element, in the continuum: the integral of '
        'sqrt(2 psi) over the configuration',
        'the alpha_j locally lower the energy expenditure for switching between stable states '
        '(p. 3)',
    )
