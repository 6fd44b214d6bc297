# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The strokes and throws that ship: as a function of the site, for 9 and for 25 cells to a level.

Found by `analysis.designer.stroke_search`; docs/going_back.md tells their windows.
"""

from __future__ import annotations

from typing import Any

from .settings import ActuatorSettings, EraseSettings, StrokeSettings, ThrowSettings


def actuator(hand_rate: float) -> ActuatorSettings:
    """Return an actuator that throws walls, and is as slow by hand as one that does not."""
    return ActuatorSettings(max_strain=0.15, max_rate=5e-3, hand_rate=hand_rate)


def throw(
    peak: float,
    ramp: float,
    ease: float,
    ease_to: float,
    settle: float,
    *,
    second: float = -0.65,
    levels: int = 10_000,
) -> ThrowSettings:
    """Return a throw, and a rest after it in which a thrown wall flies out."""
    return ThrowSettings(
        ramp=ramp, hold=20.0, ease=ease, ease_to=ease_to, release=240.0, settle=settle,
        peak=peak, mirrored=second, levels=levels,
    )  # fmt: skip


def by_9(levels: int, N: int) -> dict[str, Any]:
    """Return the strokes of nine cells to a level: one law for all such elements.

    The longer the element the more its far end is shaken: it is swung over more slowly, and its
    low levels, which take the strongest strokes, have none from even levels; beyond 400 cells no
    even level has one by this law.

    Args:
        levels: Their number.
        N: Number of cells.
    """
    site, even_from = 9.0 * levels, max(8, 2 * round(4.0 * (N / 207.0) ** 0.7))
    found = {}
    if levels > 3:
        found['down_odd'] = StrokeSettings(
            ramp=200.0, hold=40.0, ease=float(round(80.0 * max(1.0, N / 410.0))), ease_to=-0.84,
            release=660.0, settle=0.0, peak=-round(0.0082 * (288.0 / site) ** 0.77, 4),
            growth=0.77, lowest=3,
        )  # fmt: skip
    if levels > even_from + 1 and N <= 400:
        found['down_even'] = StrokeSettings(
            ramp=580.0, hold=20.0, ease=float(round(61.0 * (N / 207.0) ** 0.3)), ease_to=-0.948,
            release=800.0, settle=0.0, peak=-round(5.46 / site, 4), growth=1.0, levels=2,
            lowest=even_from,
        )  # fmt: skip
    return found


BY_25: dict[str, Any] = {
    'erase': EraseSettings(method='pulse'),
    'down_even': StrokeSettings(
        ramp=1300.0, hold=20.0, ease=293.0, ease_to=-0.023, release=1340.0, settle=0.0,
        peak=0.045, growth=0.119,
    ),
    'down_odd': StrokeSettings(
        ramp=320.0, hold=20.0, ease=60.0, ease_to=-0.5, release=940.0, settle=0.0,
        peak=-0.025, growth=0.35,
    ),
    'up_even': StrokeSettings(
        ramp=500.0, hold=20.0, ease=360.0, ease_to=0.37, release=440.0, settle=0.0,
        peak=-0.0354, growth=0.148,
    ),
    'up_odd': StrokeSettings(
        ramp=420.0, hold=20.0, ease=84.0, ease_to=-0.665, release=1100.0, settle=0.0,
        peak=0.0277, growth=0.32, levels=2,
    ),
    'throw': throw(0.135, 300.0, 66.0, -0.02, 600.0),
}  # fmt: skip
"""What moves a wall in haste where a level has the paper's 25 cells."""
