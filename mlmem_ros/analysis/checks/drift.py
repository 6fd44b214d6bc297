# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What pulls a wall to the next defect once the strain is zero, and what holds it back."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from ...physics import StateError
from ...verdict import Verdict
from ..quasistatic import lattice_ripple, self_energy
from .finding import Finding, judged
from .subject import LAUNCH, Subject

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
    if verdict is Verdict.PASS:
        text = (
            'gradient and defect pull a wall over the Peierls-Nabarro barrier all the way; '
            f'the weakest pull is {where}'
        )
    else:
        text = (
            f'the Peierls-Nabarro barrier of the lattice '
            f'{"stops" if verdict is Verdict.FAIL else "may stop"} a wall {where}, before it has '
            'reached the next defect: choose a stronger gradient (gamma), or a smaller J'
        )
    values = {
        'barrier': float(np.ptp(ripple.energy)),
        'barrier force': float(np.abs(ripple.slope).max()),
        'gradient force': subject.gradient_force,
        'least pull': pulls[weakest],
    }
    return Finding('peierls_nabarro', values, 'k_r cells', verdict, text, SOURCE)


def _rigidity(subject: Subject) -> Finding:
    design = subject.design
    X, own = self_energy(design)
    slope = np.gradient(own, X)
    nets, alone = [], []
    for way in subject.ways.values():
        back = np.interp(way.X % design.J_s, X, slope)
        nets.append(-float((way.slope + back).max()))
        alone.append(-float(way.slope.max()))
    if min(alone) <= 0.0:  # no substrate helps: `peierls_nabarro` reports that
        nets = [subject.gradient_force - float(slope.max())]
    verdict = _judge(subject, min(nets))
    if verdict is Verdict.FAIL and design.substrate == 'rigid':
        verdict = Verdict.WARN
    if verdict is Verdict.PASS:
        text = 'the substrate is stiff enough not to trap the wall that strains it'
    else:
        text = (
            'so soft a substrate yields under the wall and holds it back where it is softest'
            + (', which the rigid model neglects' if design.substrate == 'rigid' else '')
            + ': choose a greater s_min'
        )
    ratio = design.s_min / max(1.0, design.k_s1, design.k_s2)
    values = {
        'own pull': float(np.abs(slope).max()),
        'least pull': min(nets),
    }
    source = 'proper function requires min(s) >> max(k_r, k_si) (p. 2)'
    return Finding(
        'rigidity',
        values,
        'k_r cells',
        verdict,
        f'{text}; s_min is {ratio:.0f} times max(k_r, k_s)',
        source,
    )


def _judge(subject: Subject, pull: float) -> Verdict:
    share = pull / subject.gradient_force if subject.gradient_force > 0.0 else -math.inf
    return judged(share, STOPPED, COMFORT)
