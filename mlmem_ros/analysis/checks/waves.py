# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Small waves: the bands of both phases, and which carriers a wall reflects."""

from __future__ import annotations

import math
from collections.abc import Iterator

from ...device.end import End
from ...physics.dispersion import band
from ...verdict import Verdict
from .finding import Finding
from .subject import Subject

DEAF = 0.02
"""Fraction of a pulse's energy in the band below which nothing of it propagates."""


def check(subject: Subject) -> Iterator[Finding]:
    """Yield the findings on the bands and on the carrier of either end."""
    design, settings = subject.design, subject.settings
    low, high = float(design.alpha.min()), float(design.alpha.max())
    edges = {}
    for name, k_s in (('s1', design.k_s1), ('s2', design.k_s2)):
        edges[f'{name} from'], edges[f'{name} to'] = band(k_s)
    edges['s2 to, far end'] = band(design.k_s2 * low)[1]
    yield Finding(
        'bands',
        edges,
        'rad/time',
        Verdict.PASS,
        'frequencies that propagate in either phase, where alpha is 1 and where it is least',
        'the propagating and attenuating frequency bands (Fig. 3a, Eq. 4)',
    )
    # A carrier must propagate in its own phase all along the way, wherever the wall is.
    whole = {
        's1': (band(design.k_s1 * high)[0], band(design.k_s1 * low)[1]),
        's2': (band(design.k_s2 * high)[0], band(design.k_s2 * low)[1]),
    }
    own = whole['s2']
    alone = max(own[0], band(design.k_s1 * high)[1]), own[1]
    left, right = settings.probe, settings.probe_right
    if End.LEFT in subject.ends:
        yield _carrier(End.LEFT, left.omega_c, left.sigma, own, alone, whole['s1'])
    own = whole['s1']
    alone = own[0], min(own[1], band(design.k_s2 * low)[0])
    yield _carrier(End.RIGHT, right.omega_c, right.sigma, own, alone, whole['s2'])


def _carrier(
    end: End,
    omega: float,
    sigma: float,
    own: tuple[float, float],
    alone: tuple[float, float],
    others: tuple[float, float],
) -> Finding:
    """Judge a carrier by three windows: its `own` band, the part `alone`, the other phase's."""
    share, clear = _share(omega, sigma, own), _share(omega, sigma, alone)
    phase, other = ('s2', 's1') if end is End.LEFT else ('s1', 's2')
    inside = _inside(omega, own)
    where = f'the band of {phase}, {own[0]:.4g} to {own[1]:.4g}'
    if share < DEAF:
        verdict = Verdict.FAIL
        place = f'in the band of {other} alone' if _inside(omega, others) else 'in neither band'
        text = f'{omega:g} is {place} and does not propagate: choose one inside {where}'
        if inside:  # a pulse so short that its spectrum is everywhere
            text = f'hardly any of the pulse is within {where}: choose a larger sigma'
    elif not inside:
        verdict = Verdict.WARN
        text = f'{omega:g} is outside {where}: only the edge of the pulse propagates'
    elif not _inside(omega, alone):
        verdict = Verdict.WARN
        text = f'{omega:g} also propagates in {other}, so the wall reflects only part of it'
    else:
        verdict = Verdict.PASS
        text = f'{omega:g} propagates in {phase} and not in {other}: the wall reflects it'
    return Finding(
        f'carrier_{end}',
        {'carrier': omega, 'usable from': alone[0], 'usable to': alone[1]},
        'rad/time',
        verdict,
        f'{text}; {share:.0%} of the pulse propagates, {clear:.0%} in {phase} alone',
        'the carrier frequency is restricted to lie within the propagating band associated with '
        'the designated active configuration (p. 5)',
    )  # fmt: skip


def _inside(omega: float, window: tuple[float, float]) -> bool:
    return window[0] < omega < window[1]


def _share(omega: float, sigma: float, window: tuple[float, float]) -> float:
    """Return the fraction of a Gaussian pulse's energy in a window; 0 for an empty one."""
    if window[0] >= window[1]:
        return 0.0
    low, high = (math.erf(sigma * (edge - omega)) for edge in window)
    return 0.5 * (high - low)
