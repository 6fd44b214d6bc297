# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Small waves: the bands of both phases, and which carriers a wall reflects."""

from __future__ import annotations

import math
from collections.abc import Iterator

from mlmem_ros.device.end import End
from mlmem_ros.device.settings import ProbeSettings
from mlmem_ros.host.design_check import Verdict
from mlmem_ros.physics.waves import band

from .concern import Finding, Subject

DEAF = 0.02
"""Fraction of a pulse's energy in the band below which nothing of it propagates."""

REFLECTED = 0.2
"""Fraction of a pulse's energy that propagates in one phase alone from which the wall returns a
clear echo, even if the carrier itself is just within the other band, where fronts are steeper."""

Window = tuple[float, float]
"""Lowest and highest angular frequency."""


def check(subject: Subject) -> Iterator[Finding]:
    """Yield the findings on the bands and on the carrier of either end."""
    design, settings = subject.design, subject.settings
    low, high = float(subject.made.alpha.min()), float(subject.made.alpha.max())
    s1, s2 = band(design.k_s1), band(design.k_s2)
    yield Finding(
        'bands',
        {
            's1 from': s1[0], 's1 to': s1[1], 's2 from': s2[0], 's2 to': s2[1],
            's2 to, far end': band(design.k_s2 * low)[1],
        },
        'rad/time',
        Verdict.PASS,
        'frequencies that propagate in either phase, where alpha is 1 and where it is least',
        'the propagating and attenuating frequency bands (Fig. 3a, Eq. 4)',
    )  # fmt: skip
    # A carrier must propagate in its own phase all along the way, wherever the wall is.
    whole_1 = band(design.k_s1 * high)[0], band(design.k_s1 * low)[1]
    whole_2 = band(design.k_s2 * high)[0], band(design.k_s2 * low)[1]
    alone = max(whole_2[0], band(design.k_s1 * high)[1]), whole_2[1]
    yield _carrier(End.LEFT, settings.probe, whole_2, alone, whole_1)
    alone = whole_1[0], min(whole_1[1], band(design.k_s2 * low)[0])
    yield _carrier(End.RIGHT, settings.probe_right, whole_1, alone, whole_2)


def _carrier(
    end: End, probe: ProbeSettings, own: Window, alone: Window, others: Window
) -> Finding:
    """Judge a carrier by three windows: its `own` band, the part `alone`, the other phase's."""
    omega, sigma = probe.omega_c, probe.sigma
    share, clear = _share(omega, sigma, own), _share(omega, sigma, alone)
    phase, other = ('s2', 's1') if end is End.LEFT else ('s1', 's2')
    inside = _inside(omega, own)
    where = f'the band of {phase}, {own[0]:.4g} to {own[1]:.4g}'
    verdict = Verdict.WARN
    if share < DEAF:
        verdict = Verdict.FAIL
        place = f'in the band of {other} alone' if _inside(omega, others) else 'in neither band'
        text = f'{omega:g} is {place} and does not propagate: choose one inside {where}'
        if inside:  # a pulse so short that its spectrum is everywhere
            text = f'hardly any of the pulse is within {where}: choose a larger sigma'
    elif not inside:
        text = f'{omega:g} is outside {where}: only the edge of the pulse propagates'
    elif not (_near(omega, sigma, alone) and clear >= REFLECTED):
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
        'the carrier frequency is restricted to lie within the propagating band associated with '
        'the designated active configuration (p. 5)',
    )


def _inside(omega: float, window: Window) -> bool:
    return window[0] < omega < window[1]


def _near(omega: float, sigma: float, window: Window) -> bool:
    """Whether a carrier is in a window, or beside it by a quarter of its bandwidth 1 / sigma."""
    return _inside(omega, (window[0] - 0.25 / sigma, window[1] + 0.25 / sigma))


def _share(omega: float, sigma: float, window: Window) -> float:
    """Return the fraction of a Gaussian pulse's energy in a window; 0 for an empty one."""
    low, high = (math.erf(sigma * (edge - omega)) for edge in window)
    return max(0.0, 0.5 * (high - low))
