# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The defects: how deep they pin a wall, and at what strain they release it."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from ...physics import StateError
from ...verdict import Verdict
from ..quasistatic import held_landscape
from .finding import Finding, judged
from .subject import LARGEST_STRAIN, Subject

CAPTURE = (1.0, 4.0)
"""Depth of a pin over the kinetic energy of an incoming wall: needed, and comfortable."""


def check(subject: Subject) -> Iterator[Finding]:
    """Yield the findings on the depth of the pins and the strains that free a wall."""
    yield _depth(subject)
    yield from _de_pinning(subject)


def _depth(subject: Subject) -> Finding:
    design = subject.design
    depths = {}
    for level in sorted({0, design.levels - 1}):
        depths[f'level {level}'] = pin_depth(subject, level)
    speed = min(abs(subject.drift_speed), 1.0)  # a wall is never faster than waves
    incoming = 0.5 * subject.wall_energy * speed**2
    least = float(np.min(list(depths.values())))  # NaN if a level holds no wall
    ratio = least / incoming if incoming > 0.0 else math.inf
    verdict = judged(ratio, *CAPTURE)
    return Finding(
        'pin_depth',
        {**depths, 'incoming wall': incoming},
        'k_r cells^2',
        verdict,
        'the defects are deeper than the energy of a wall that the gradient drives in'
        if verdict is Verdict.PASS
        else 'a wall may run over a defect: choose a softer defect (beta), a smaller gamma or '
        'more damping',
        'a soft defect locally lowers the energy and, aided by dissipative effects, may pin an '
        'incoming transition wave (p. 3)',
    )


def pin_depth(subject: Subject, level: int) -> float:
    """Return the energy that a wall needs to leave a level rightward, without strain."""
    design = subject.design
    defect = design.defect(level)
    if design.beta >= 0.0:
        return 0.0  # a stiff defect repels: nothing holds a wall
    end = min(defect + 0.5 * design.J, design.N - 1.0)
    try:
        hold = held_landscape(design, defect - 1.0, end)
    except StateError:
        return math.nan
    return float(hold.energy.max() - hold.energy.min())


def _de_pinning(subject: Subject) -> Iterator[Finding]:
    design = subject.design
    kinds = {'compression': (-1.0, True), 'tension': (1.0, False)}
    for kind, (forward, compressed) in kinds.items():
        levels = [n for n in (0, 1) if n < design.levels]
        level = next((n for n in levels if design.freed_by_compression(n) is compressed), None)
        if level is None:
            continue
        values = {
            'wall forward': subject.freeing(level, forward),
            'wall back': subject.freeing(level, -forward),
            'kink forward': subject.freeing(level, -forward, kink=True),
            'kink back': subject.freeing(level, forward, kink=True),
        }
        held = math.isnan(values['wall forward']) or math.isnan(values['kink forward'])
        yield Finding(
            f'freed_by_{kind}',
            values,
            'strain',
            Verdict.WARN if held and design.levels > 1 else Verdict.PASS,
            f'strains that free a wall from level {level}: {kind} moves it on; the opposite '
            'strain moves the kink of an erase'
            if not held
            else f'no strain up to {LARGEST_STRAIN:g} frees a wall from level {level}: choose a '
            'smaller |beta|',
            'for a sufficient strain, energy extrema not aligned with the defect induce '
            'de-pinning; the critical strain depends on the deformation mode (p. 4)',
        )
