# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A faster write by search over the parts of its time and both peaks.

The rules of `schedules` hold if ramps are slow compared with the damping. Faster ones depend on
inertia and ringing, and are found by trial: steps in a row on the bare chain, with both peaks off
in many directions at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...device.settings import WriteSettings
from ...physics import Design
from ...physics.potential import Array
from ..bare import COARSE, departures, scaled
from . import cma_es
from .cma_es import TRIALS, Off

STEP_SIZE = 0.25
"""Standard deviation of the first trials: a quarter of a share or a peak."""


@dataclass(frozen=True)
class WriteTask:
    """The steps that a write has to make.

    Attributes:
        design: The element.
        starts: Levels to start from; the first step from an odd one is the hardest.
        length: Steps in a row from each, fewer where the element ends.
    """

    design: Design
    starts: Sequence[int] = (0, 1)
    length: int = 3

    def departures(self, write: WriteSettings, off: Off = (0.0, 0.0)) -> Array:
        """Return how far the wall is from its defect after every step, in cells.

        Args:
            write: The cycles.
            off: Relative changes of compression and tension.
        """
        changed = scaled(write, 1.0 + off[0], 1.0 + off[1])
        last = self.design.levels - 1
        rows = ((start, min(start + self.length, last)) for start in self.starts)
        return np.array(
            [x for row in rows for x in departures(self.design, changed, *row, dt=COARSE)]
        )

    def cost(self, write: WriteSettings) -> float:
        """Return the number of failed steps with both peaks off, plus a little for walls far off.

        A wall counts up to a tenth of a step, by its distance over the spacing of levels, so that
        the search has a slope to follow.
        """
        away = np.concatenate([self.departures(write, off) for off in TRIALS])
        return float((away >= 1.0).sum() + 0.1 * np.minimum(away / self.design.J, 1.0).sum())


def search(
    task: WriteTask, write: WriteSettings, time: float, *, tick: float, trials: int
) -> WriteSettings:
    """Return the best write found for a given time per level.

    Args:
        task: What it has to do.
        write: Where to begin; everything not searched is taken from it. It rests only after its
            last cycle.
        time: Time units of a cycle.
        tick: Every part is a whole number of ticks.
        trials: Number of schedules to try.
    """

    def point(x: Array) -> WriteSettings:
        return schedule(replace(write, settle=0.0), x, time, tick)

    cut = point(np.zeros(cma_es.DIMENSIONS))
    return cma_es.search(cut, point, task.cost, sigma=STEP_SIZE, trials=trials)


def schedule(begin: WriteSettings, x: Array, time: float, tick: float) -> WriteSettings:
    """Return the write at a point of the search; at 0 the one it begins with.

    Args:
        begin: Whose shares of the time and peaks are multiplied by exp(x).
        x: Of ramp, hold, ease, release, where the ease ends, and both peaks, shape (7,).
        time: Time units of a cycle.
        tick: The unit of every part.
    """
    parts = np.array([begin.ramp, begin.hold, begin.ease, begin.release]) * np.exp(x[:4])
    ticks = np.maximum(np.round(parts / parts.sum() * time / tick), (1.0, 0.0, 1.0, 1.0))
    ticks[2] = max(1.0, ticks[2] + round(time / tick) - ticks.sum())  # what rounding took
    ramp, hold, ease, release = (ticks * tick).tolist()
    ease_to, compression, tension = np.exp(x[4:]).tolist()
    return replace(
        begin,
        ramp=ramp,
        hold=hold,
        ease=ease,
        ease_to=round(min(1.0, ease_to * begin.ease_to), 3),
        release=release,
        compression=round(compression * begin.compression, 4),
        tension=round(tension * begin.tension, 4),
    )
