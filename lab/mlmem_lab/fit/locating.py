# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where the wall rested when a shot was fired: the equilibrium that explains its waveforms best.

A survey drives the wall without a look where it arrives, and cells that scatter hold it anywhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mlmem_ros.device.end import Shot
from mlmem_ros.physics.potential import Array
from mlmem_tools.twin.forward import NEAR, Forward, equilibria

from .descent import AGAIN, minimise
from .misfit import Misfit

WINDOW = 300.0
"""Time after a pulse in which its waveforms are compared."""

BLUR = 3e-4
"""Least standard deviation of a sample: the element is not yet known well."""


TRIED = 3
"""Places that are tried for the first wall."""

APART = 2.0
"""Least distance between two of them in cells: a fit moves between nearer ones."""


def located(misfit: Misfit, x: Array, shots: Sequence[Shot]) -> tuple[list[Shot], Array]:
    """Return shots with their walls where they most probably were, and better values.

    Shots that were fired at the same supposed site saw the same wall. The first wall shows how
    waves travel in the active phase, which a blank element does not tell: so some places, and the
    one nearest to the supposed site, are tried in turn: what all cells share is fitted to each.

    Shots without a wall stay as they are; x are values as fitted to the blank element.
    """
    blank = [shot for shot in shots if not shot.wall]
    found = {0.0: 0.0}
    for supposed in sorted({shot.wall for shot in shots if shot.wall}):
        same = [shot for shot in shots if shot.wall == supposed]
        places = ranked(misfit, x, same)
        found[supposed] = places[0] if places else supposed
        if len(found) == 2:
            tried = []
            nearest = sorted(places, key=lambda place: abs(place - supposed))[:1]
            for place in dict.fromkeys((*nearest, *_apart(places)[:TRIED])):
                guess = misfit.only(blank + _moved(same, place))
                tried.append((*_refined(guess, x), place))
            x, _, found[supposed] = min(tried, key=lambda each: each[1])
    return [replace(shot, wall=found[shot.wall]) for shot in shots], x


def relocated(misfit: Misfit, x: Array, shots: Sequence[Shot]) -> list[Shot]:
    """Return shots with their walls where they were, at most `NEAR` from where they were found."""
    found = {0.0: 0.0}
    for known in {shot.wall for shot in shots if shot.wall}:
        same = [shot for shot in shots if shot.wall == known]
        places = ranked(misfit, x, same, known)
        found[known] = places[0] if places else known
    return [replace(shot, wall=found[shot.wall]) for shot in shots]


def ranked(
    misfit: Misfit, x: Array, shots: Sequence[Shot], near: float | None = None
) -> list[float]:
    """Return where the wall of some shots can have rested, the most probable place first.

    The shots have the same wall; `near` takes only places at most `NEAR` from there.
    """
    forward, N = misfit.forward(x), misfit.unknowns.design.N
    sites = np.arange(2.0, N)
    if near is not None:
        sites = sites[np.abs(sites - near) <= NEAR]
    scores = {
        place: sum(_score(misfit, forward, shot) for shot in _moved(shots, place))
        for place in equilibria(forward, shots[0], sites)
    }
    return sorted(scores, key=lambda place: scores[place])


def _moved(shots: Sequence[Shot], place: float) -> list[Shot]:
    return [replace(shot, wall=place) for shot in shots]


def _apart(places: Sequence[float]) -> list[float]:
    """Return places that are not close to a better one."""
    kept: list[float] = []
    for place in places:
        if all(abs(place - other) > APART for other in kept):
            kept.append(place)
    return kept


def _refined(misfit: Misfit, x: Array) -> tuple[Array, float]:
    """Return values with what all cells share fitted, and the misfit."""
    cost = np.inf
    for stage in AGAIN:
        x, cost, _ = minimise(misfit, x, stage)
    return x, cost


def _score(misfit: Misfit, forward: Forward, shot: Shot) -> float:
    predicted = forward.predict(shot, shot.pulse.duration + WINDOW)
    return float(np.sum(misfit.residuals(shot, predicted, BLUR)[0] ** 2))
