# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The defects: how deep they pin a wall, and at what strain they release it."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from mlmem_ros.host.design_check import Verdict
from mlmem_ros.physics import StateError

from .concern import LARGEST_STRAIN, Finding, Subject, graded, judged
from .quasistatic import held_landscape

CAPTURE = (1.0, 4.0)
"""Depth of a pin over the kinetic energy of an incoming wall: needed, and comfortable."""


def check(subject: Subject) -> Iterator[Finding]:
    """Yield the findings on the depth of the pins and the strains that free a wall."""
    yield _depth(subject)
    if not subject.settings.actuator.present:
        return
    for kind, forward in (('compression', -1.0), ('tension', 1.0)):
        compressed = forward < 0.0
        levels = range(min(2, subject.design.levels))
        freed = [n for n in levels if subject.design.freed_by_compression(n) is compressed]
        if freed:
            yield _release(subject, kind, forward, freed[0])


def _depth(subject: Subject) -> Finding:
    last = subject.design.levels - 1
    depths = {f'level {level}': _pin_depth(subject, level) for level in sorted({0, last})}
    speed = min(abs(subject.drift_speed), 1.0)  # a wall is never faster than waves
    incoming = 0.5 * subject.wall_energy * speed**2
    least = float(np.min(list(depths.values())))  # NaN if a level holds no wall
    spare = least / incoming if incoming > 0.0 else math.inf
    return graded(
        'pin_depth',
        {**depths, 'incoming wall': incoming},
        'k_r cells^2',
        judged(least if math.isnan(least) else spare, *CAPTURE),
        'the defects are deeper than the energy of a wall that the gradient drives in',
        'a wall may run over a defect: choose a softer defect (beta), a smaller gamma or '
        'more damping',
        'a soft defect locally lowers the energy and, aided by dissipative effects, may pin an '
        'incoming transition wave (p. 3)',
    )


def _pin_depth(subject: Subject, level: int) -> float:
    """Return the energy that a wall needs to leave a level rightward, without strain."""
    design = subject.design
    defect = design.defect(level)
    if design.beta >= 0.0:
        return 0.0  # a stiff defect repels: nothing holds a wall
    end = min(defect + 0.5 * design.J, design.N - 1.0)
    try:
        return float(np.ptp(held_landscape(subject.made, defect - 1.0, end).energy))
    except StateError:
        return math.nan


def _release(subject: Subject, kind: str, forward: float, level: int) -> Finding:
    """Judge a level whose wall is moved on by compression (forward < 0) or tension."""
    values = {
        'wall forward': subject.freeing(level, forward),
        'wall back': subject.freeing(level, -forward),
        'kink forward': subject.freeing(level, -forward, kink=True),
        'kink back': subject.freeing(level, forward, kink=True),
    }
    held = math.isnan(values['wall forward']) or math.isnan(values['kink forward'])
    good = (
        f'strains that free a wall from level {level}: {kind} moves it on; the opposite '
        'strain moves the kink of an erase'
    )
    bad = (
        f'no strain up to {LARGEST_STRAIN:g} frees a wall from level {level}: choose a '
        'smaller |beta|'
    )
    return Finding(
        f'freed_by_{kind}',
        values,
        'strain',
        Verdict.WARN if held else Verdict.PASS,
        bad if held else good,
        'for a sufficient strain, energy extrema not aligned with the defect induce '
        'de-pinning; the critical strain depends on the deformation mode (p. 4)',
    )
