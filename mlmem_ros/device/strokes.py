# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The shipped strokes, throws, kicks and pushes, for 9 and for 25 cells per level.

Strokes and throws were found by `mlmem_lab.designer.stroke_search`, kicks and pushes by
`mlmem kicks`; docs/reference/results.md gives the ranges in which they work.
"""

from __future__ import annotations

from typing import Any

from .move_settings import EraseSettings, KickSettings, PushSettings, StrokeSettings, ThrowSettings
from .settings import ActuatorSettings


def hand_rate(N: int) -> float:
    """Return the strain rate in 1/time at which a strain set by hand keeps the content of N cells.

    Measured on every preset: below the strain that frees its wall, none is lost at this rate, some
    at twice the rate. A longer substrate sways longer.
    """
    return min(5e-5, float(f'{0.016 / N:.1e}'))


def actuator(N: int) -> ActuatorSettings:
    """Return an actuator of N cells that is fast enough to throw walls, and slow by hand."""
    return ActuatorSettings(max_strain=0.15, max_rate=5e-3, hand_rate=hand_rate(N))


def throw(
    peak: float, ramp: float, ease: float, ease_to: float, settle: float, **others: Any
) -> ThrowSettings:
    """Return a throw, followed by a rest in which the thrown wall flies out."""
    return ThrowSettings(ramp, 20.0, ease, ease_to, 240.0, settle, peak, **others)


def stroke(
    ramp: float,
    hold: float,
    ease: float,
    ease_to: float,
    release: float,
    peak: float,
    growth: float,
    **others: Any,
) -> StrokeSettings:
    """Return a stroke without a rest after it."""
    return StrokeSettings(ramp, hold, ease, ease_to, release, 0.0, peak, growth, **others)


def by_9(levels: int, N: int, eta: float) -> dict[str, Any]:
    """Return strokes, kicks and pushes for nine cells per level: one law for all such elements.

    The longer the element, the more its far end is shaken. So the strain swings over more slowly,
    and low levels, which need the strongest strokes, have none if they are even. Beyond 400 cells
    this law gives no stroke from even levels.
    """
    site, even_from = 9.0 * levels, max(8, 2 * round(4.0 * (N / 207.0) ** 0.7))
    speeds = ' '.join(f'{speed:g}' for speed in SPEEDS_9.get(round(1.0 / eta), ())[:levels])
    found: dict[str, Any] = {
        'kick': KickSettings(speeds, late=LATE),
        'push': PushSettings(A=0.6, omega_c=0.75, sigma=5.0, settle=800.0 if N < 150 else 1200.0),
    }
    if levels > 3:
        ease, peak = round(80.0 * max(1.0, N / 410.0)), -round(0.0082 * (288.0 / site) ** 0.77, 4)
        found['down_odd'] = stroke(200.0, 40.0, float(ease), -0.84, 660.0, peak, 0.77, lowest=3)
    if levels > even_from + 1 and N <= 400:
        ease, peak = round(61.0 * (N / 207.0) ** 0.3), -round(5.3 / site, 4)
        found['down_even'] = stroke(
            580.0, 20.0, float(ease), -0.948, 800.0, peak, 1.0, levels=2, lowest=even_from
        )
    return found


LATE = 0.7
"""With nine cells a level: the end is fastest late, which widens the windows at high speeds."""

SPEEDS_9 = {
    100: (0.0031, 0.0103, 0.0222, 0.0367, 0.0547, 0.0773, 0.1074, 0.1474, 0.2026),
    250: (0.002, 0.0039, 0.007, 0.0106, 0.0146, 0.0191, 0.0241),
    500: (0.0, 0.0024, 0.0034, 0.0047, 0.0062, 0.0078),
}
"""Speeds of kicks by 1 / eta, to every level with a room of at least 0.1; others are barred."""

BY_25: dict[str, Any] = {
    'erase': EraseSettings(method='pulse'),
    'down_even': stroke(1300.0, 20.0, 293.0, -0.023, 1340.0, 0.045, 0.119),
    'down_odd': stroke(320.0, 20.0, 60.0, -0.5, 940.0, -0.025, 0.35),
    'up_even': stroke(500.0, 20.0, 360.0, 0.37, 440.0, -0.0354, 0.148),
    'up_odd': stroke(420.0, 20.0, 84.0, -0.665, 1100.0, 0.0277, 0.32, levels=2),
    'throw': throw(0.135, 300.0, 66.0, -0.02, 600.0, not_from='1 6 7'),
    'kick': KickSettings(
        '0.006 0.0145 0.0316 0.053 0.0793 0.1207 0.18 0.258',
        rooms='0.51 0.58 0.33 0.23 0.17 0.26 0.15 0.23',
    ),
    'push': PushSettings(A=0.62, omega_c=0.74, sigma=12.0, settle=800.0, after=1.1, room=0.3),
}
"""Strokes, a throw, kicks and a push for the paper's 25 cells per level."""
