# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What pulls a wall to the next defect once the strain is zero, and what holds it back."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from mlmem_ros.host.design_check import Verdict
from mlmem_ros.physics import StateError

from .concern import LAUNCH, Finding, Subject, graded, judged
from .quasistatic import lattice_ripple, self_energy

STOPPED = -0.1
"""Pull, relative to the gradient's mean, at which a wall stops. Case II with a weaker gamma: at
-0.07 its inertia still carried it across in all seven steps, at -0.18 in six."""

COMFORT = 0.05
"""Least comfortable force on the way, relative to the gradient's mean."""

SOURCE = (
    'as the strain decreases, the gradient in psi enforced by alpha drives the transition wave '
    'to the soft defect pinning site (Fig. 4)'
)


def check(subject: Subject) -> Iterator[Finding]:
    """Yield the findings on the lattice's barrier and on the stiffness of the substrate."""
    try:
        yield _lattice(subject)
        yield _rigidity(subject)
    except StateError as error:
        text = f'no wall can be held on its way between two defects: {error}'
        yield Finding('peierls_nabarro', {}, '', Verdict.FAIL, text, SOURCE)


def _lattice(subject: Subject) -> Finding:
    ripple = lattice_ripple(subject.design)
    pulls = {level: -float(way.slope.max()) for level, way in subject.ways.items()}
    weakest = min(pulls, key=lambda level: pulls[level])
    verdict = _judge(subject, pulls[weakest])
    where = 'after a launch' if weakest == LAUNCH else f'after level {weakest}'
    stops = 'stops' if verdict is Verdict.FAIL else 'may stop'
    return graded(
        'peierls_nabarro',
        {
            'barrier': float(np.ptp(ripple.energy)),
            'barrier force': float(np.abs(ripple.slope).max()),
            'gradient force': subject.gradient_force,
            'least pull': pulls[weakest],
        },
        'k_r cells',
        verdict,
        'gradient and defect pull a wall over the Peierls-Nabarro barrier all the way; '
        f'the weakest pull is {where}',
        f'the Peierls-Nabarro barrier of the lattice {stops} a wall {where}, before it '
        'reaches the next defect: choose a stronger gradient (gamma), or a smaller J',
        SOURCE,
    )


def _rigidity(subject: Subject) -> Finding:
    design = subject.design
    X, own = self_energy(design)
    slope = np.gradient(own, X)
    ways = subject.ways.values()
    back = [np.interp(way.X % design.J_s, X, slope) for way in ways]
    least = min(-float((way.slope + pull).max()) for way, pull in zip(ways, back, strict=True))
    if max(float(way.slope.max()) for way in ways) >= 0.0:
        # A stiffer substrate would not help: `peierls_nabarro` reports that.
        least = subject.gradient_force - float(slope.max())
    rigid = design.substrate == 'rigid'
    verdict = _judge(subject, least)
    ratio = design.s_min / max(1.0, design.k_s1, design.k_s2)
    stiffness = f's_min is {ratio:.0f} times max(k_r, k_s)'
    return graded(
        'rigidity',
        {'own pull': float(np.abs(slope).max()), 'least pull': least},
        'k_r cells',
        Verdict.WARN if rigid and verdict is Verdict.FAIL else verdict,
        f'the substrate is too stiff to trap the wall that strains it; {stiffness}',
        'the substrate yields under the wall and holds it back where it is softest'
        f'{", which the rigid model neglects" if rigid else ""}: choose a greater s_min; '
        f'{stiffness}',
        'proper function requires min(s) >> max(k_r, k_si) (p. 2)',
    )


def _judge(subject: Subject, pull: float) -> Verdict:
    share = pull / subject.gradient_force if subject.gradient_force > 0.0 else -math.inf
    return judged(share, STOPPED, COMFORT)
