# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Writes upward on the bare chain: from each level to each higher one, in one go.

The cycles follow each other as in a write of the device, which rests `write.final_settle` longer
after the last; then the true wall is looked at, and has to be within a cell of its defect.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Iterator

import numpy as np

from ..device.settings import CycleSettings, WriteSettings
from ..physics import Chain, Design, StateError
from ..physics.equilibrium import resting_wall
from ..physics.potential import Array
from .trace import Segment, level_of, strain_chain

STEP = 0.5
"""Time step; the wall's own motion is a hundred times slower."""


def pulse(peak: float, times: CycleSettings) -> list[Segment]:
    """Return the segments of one cycle, without the last rest of a write."""
    eased = [(times.ease_to * peak, times.ease)] if times.ease else []
    back = [*eased, (0.0, times.release), (0.0, times.settle)]
    return [(peak, times.ramp), (peak, times.hold), *back]


def duration(times: CycleSettings) -> float:
    """Return the time units that one level takes."""
    return sum(time for _, time in pulse(1.0, times))


def writes(
    design: Design, write: WriteSettings, starts: Iterable[int] | None = None
) -> Iterator[bool]:
    """Yield for every write upward whether it succeeds.

    Args:
        design: The element.
        write: Its cycles. The rate of an actuator does not limit them here.
        starts: The levels that are started from, a wall at rest at each; all by default.
    """
    chain, last = Chain(design, STEP), design.levels - 1
    for start in range(last) if starts is None else starts:
        chain.place(resting_wall(design, start))
        for level in range(start, last):
            compress = design.freed_by_compression(level)
            try:
                _strain(chain, pulse(write.compression if compress else write.tension, write))
                state = chain.state()
                _strain(chain, [(0.0, write.final_settle)])
                yield level_of(design, chain.configuration) == level + 1
            except StateError:  # driven so hard that the chain is lost
                yield from [False] * (last - level)
                break
            chain.restore(state, V_N=0.0, steps_done=0)


def _strain(chain: Chain, segments: list[Segment]) -> None:
    strain_chain(chain, [segment for segment in segments if segment[1] > 0.0], 1e9)


def scaled(write: WriteSettings, compression: float, tension: float) -> WriteSettings:
    """Return the settings with the peaks multiplied by factors."""
    return dataclasses.replace(
        write, compression=compression * write.compression, tension=tension * write.tension
    )


def passes(
    design: Design, write: WriteSettings, factors: Array, starts: Iterable[int] | None = None
) -> Array:
    """Return where all writes upward succeed, over factors on both peaks.

    Args:
        design: The element.
        write: The operating point.
        factors: On either peak, shape (m,).
        starts: As for `writes`, which may be passed through more than once.

    Returns:
        By compression and tension, booleans of shape (m, m).
    """
    return np.array(
        [
            [all(writes(design, scaled(write, first, second), starts)) for second in factors]
            for first in factors
        ]
    )


def distance(factors: Array, passed: Array) -> float:
    """Return how far the operating point is from the nearest failure of a map.

    The measure is that of `mlmem margins`: the root of the sum of the squares of both relative
    changes; infinite where nothing fails.

    Args:
        factors: On either peak, shape (m,).
        passed: By compression and tension, shape (m, m).
    """
    far = np.hypot(factors[:, None] - 1.0, factors[None, :] - 1.0)
    return float(np.min(far[~passed], initial=np.inf))
