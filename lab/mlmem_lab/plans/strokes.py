# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Strokes and throws of one element: which it takes, with which peak, how far from failure."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from mlmem_ros.device.drivers import Simulation
from mlmem_ros.device.moves import How, Move, moves_from
from mlmem_ros.device.presets import Preset
from mlmem_ros.device.pulse_corrections import QuickMoves, quick_schedule
from mlmem_ros.device.settings import Settings
from mlmem_ros.physics import Chain, Specimen

from ..windows.window import TIMES, end, kind

RADII = (0.03, 0.06, 0.1)
"""Relative changes at which a pulse is tried, too; the distance to failure follows."""

ENOUGH = 0.06
"""Distance to failure at which no better pulse is sought, and from which a stroke is used."""

PEAKS = (1.0, 0.95, 1.05, 0.9, 1.1, 0.8, 1.2)
"""Factors on the peak of a stroke that are tried."""


@dataclass(frozen=True)
class Stroke:
    """A stroke, or a throw, from a level.

    Attributes:
        kind: Name of its settings.
        margin: Relative distance of peak and times from failure, as far as it was tried; negative
            if no pulse was found.
    """

    kind: str
    start: int
    target: int
    peak: float
    margin: float

    @property
    def used(self) -> bool:
        """Whether it is far enough from failure."""
        return self.margin >= ENOUGH


def strokes(
    specimen: Specimen, preset: Preset, report: Callable[[str, float], object] | None = None
) -> list[Stroke]:
    """Return the strokes and throws of an element that the settings allow, from every level.

    The preset is its design as built, and the settings of its instrument.
    """
    design, settings = preset
    chain, found = Simulation.of(specimen, settings.time).chain, []
    for level in range(design.levels):
        if report is not None:
            report(f'strokes from level {level}', level / design.levels)
        for move in moves_from(design, settings, level):
            if move.how in (How.STROKE, How.THROW):
                found.append(_best(chain, settings, move))
    return found


def quick_moves(found: Sequence[Stroke], settings: Settings) -> QuickMoves | None:
    """Return strokes and throws for a calibration; None if all are used as set."""
    peaks: dict[str, dict[int, float]] = {}
    for stroke in found:
        if not stroke.used or stroke.peak != 1.0:
            peaks.setdefault(stroke.kind, {})[stroke.start] = stroke.peak * stroke.used
    return QuickMoves(peaks, quick_schedule(settings)) if peaks else None


def _best(chain: Chain, settings: Settings, move: Move) -> Stroke:
    """Return a move with the peak that is farthest from failure."""
    best = Stroke(kind(move), move.start, move.target, 1.0, -1.0)
    for peak in PEAKS if move.how is How.STROKE else PEAKS[:1]:
        margin = _margin(chain, settings, move, peak)
        if margin > best.margin:
            best = Stroke(best.kind, move.start, move.target, peak, margin)
        if best.used:
            break
    return best


def _margin(chain: Chain, settings: Settings, move: Move, peak: float) -> float:
    def arrives(by: float, times: float) -> bool:
        off = {'peak': peak * (1.0 + by) - 1.0} | dict.fromkeys(TIMES, times)
        return end(chain, settings, move, off) == move.target

    if not arrives(0.0, 0.0):
        return -1.0
    margin = 0.0
    for r in RADII:
        if not all(arrives(*off) for off in ((r, 0.0), (-r, 0.0), (0.0, r), (0.0, -r))):
            break
        margin = r
    return margin
