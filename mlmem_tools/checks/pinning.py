# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The defects: how deep they pin a wall, and at what strain they release it; and what pulls it to
the next one once the strain is zero, or holds it back.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from mlmem.physics import StateError, wall_energy

from .concern import LAUNCH_LEVEL, Finding, Subject, Verdict, grade_finding, judge_value
from .quasistatic import compute_held_landscape, compute_lattice_ripple, compute_self_energy


def check(subject: Subject) -> Iterator[Finding]:
    """Yield the findings on the depth of the pins, the strains that free a wall, and its drift."""
    yield _judge_depth(subject)
    if not subject.settings.actuator.present:
        return
    try:
        yield _judge_lattice(subject)
        yield _judge_rigidity(subject)
    except StateError as error:
        text = f'no wall can be held on its way between two defects: {error}'
        yield Finding('peierls_nabarro', {}, '', Verdict.FAIL, text)


def _judge_depth(subject: Subject) -> Finding:
    design, last = subject.design, subject.design.levels - 1
    depths = {f'level {level}': _pin_depth(subject, level) for level in sorted({0, last})}
    speed = 1.0  # a wall is never faster than waves
    if design.eta > 0.0:  # nor than the gradient moves it against the damping
        alpha = 1.0 + design.gamma * design.defect_site(last)
        speed = min(abs(-design.gamma / (2.0 * design.eta * alpha)), speed)
    incoming = 0.5 * wall_energy(design) * speed**2
    least = float(np.min(list(depths.values())))  # NaN if a level holds no wall
    spare = least / incoming if incoming > 0.0 else math.inf
    return grade_finding(
        'pin_depth',
        {**depths, 'incoming wall': incoming},
        'k_r cells^2',
        judge_value(least if math.isnan(least) else spare, 1.0, 4.0),
        'the defects are deeper than the energy of a wall that the gradient drives in',
        'a wall may run over a defect: choose a softer defect (beta), a smaller gamma or '
        'more damping',
    )


def _pin_depth(subject: Subject, level: int) -> float:
    """Return the energy that a wall needs to leave a level rightward, without strain."""
    design = subject.design
    defect = design.defect_site(level)
    if design.beta >= 0.0:
        return 0.0  # a stiff defect repels: nothing holds a wall
    end = min(defect + 0.5 * design.J, design.N - 1.0)
    try:
        return float(np.ptp(compute_held_landscape(subject.made, defect - 1.0, end).energy))
    except StateError:
        return math.nan


def _judge_lattice(subject: Subject) -> Finding:
    ripple = compute_lattice_ripple(subject.design)
    pulls = {level: -float(way.slope.max()) for level, way in subject.landscapes.items()}
    weakest = min(pulls, key=lambda level: pulls[level])
    force = subject.gradient_force_at(subject.release_site(weakest))
    verdict = _judge_pull(force, pulls[weakest])
    where = 'after a launch' if weakest == LAUNCH_LEVEL else f'after level {weakest}'
    stops = 'stops' if verdict is Verdict.FAIL else 'may stop'
    return grade_finding(
        'peierls_nabarro',
        {
            'barrier': float(np.ptp(ripple.energy)),
            'barrier force': float(np.abs(ripple.slope).max()),
            'gradient force': force,
            'least pull': pulls[weakest],
        },
        'k_r cells',
        verdict,
        'gradient and defect pull a wall over the Peierls-Nabarro barrier all the way; '
        f'the weakest pull is {where}',
        f'the Peierls-Nabarro barrier of the lattice {stops} a wall {where}, before it '
        'reaches the next defect: choose a stronger gradient (gamma), or a smaller J',
    )


def _judge_rigidity(subject: Subject) -> Finding:
    design = subject.design
    X, own = compute_self_energy(design)
    slope = np.gradient(own, X)
    force = subject.gradient_force_at(design.J)
    ways = subject.landscapes.values()
    back = [np.interp(way.X % design.J_s, X, slope) for way in ways]
    least = min(-float((way.slope + pull).max()) for way, pull in zip(ways, back, strict=True))
    if max(float(way.slope.max()) for way in ways) >= 0.0:
        # A stiffer substrate would not help: `peierls_nabarro` reports that.
        least = force - float(slope.max())
    rigid = design.substrate == 'rigid'
    verdict = _judge_pull(force, least)
    ratio = design.s_min / max(1.0, design.k_s1, design.k_s2)
    stiffness = f's_min is {ratio:.0f} times max(k_r, k_s)'
    return grade_finding(
        'rigidity',
        {'own pull': float(np.abs(slope).max()), 'least pull': least},
        'k_r cells',
        Verdict.WARN if rigid and verdict is Verdict.FAIL else verdict,
        f'the substrate is too stiff to trap the wall that strains it; {stiffness}',
        'the substrate yields under the wall and holds it back where it is softest'
        f'{", which the rigid model neglects" if rigid else ""}: choose a greater s_min; '
        f'{stiffness}',
    )


def _judge_pull(gradient_force: float, pull: float) -> Verdict:
    share = pull / gradient_force if gradient_force > 0.0 else -math.inf
    # Case II with a weaker gamma: its inertia carries a wall across all seven steps at -0.07, and
    # across six at -0.18
    return judge_value(share, -0.1, 0.05)
