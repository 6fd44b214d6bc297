# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A map: the points of a grid over two axes, each a device whose levels are written in turn, and
the result at each.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from mlmem_ros.device import Settings, SettingsError
from mlmem_ros.device.motion import Cycle
from mlmem_ros.device.moves import paper_way
from mlmem_ros.element_file import Element
from mlmem_ros.physics import Design
from mlmem_ros.physics.potential import Array

from ..bench import Bench
from ..campaign import Campaign, Row
from ..campaign.campaign import Values
from ..climb import Climb, Heat, least_margins, write_upward
from .axes import Axis, with_values

UNFIT = 'unfit'
"""Failure of settings that give no device: no echo, or out of range."""


def rerun(shared: Values, values: Values, seed: int) -> Climb:
    """Return the climb of one point.

    For what all points share see `Shmoo.campaign`.

    Raises:
        SettingsError: These settings give no device.
    """
    bench = Bench.of(shared)
    settings, temperature = with_values(bench.settings, values)
    bench = replace(bench, settings=settings)
    element = bench.device()
    heat = Heat(element, temperature, seed) if temperature else None
    return write_upward(element, heat, bench.level)


def evaluate(shared: Values, values: Values, seed: int) -> Row:
    """Return the results of one point, as numbers and words.

    Returns:
        passed: Whether every level was written and read back.
        reached: How many were, from level 0 up.
        failure: '' or the reason: see `WrittenLevel.failure`, and `UNFIT`.
        error: What the device said.
        wall: True position of the wall at the end, None for none or several.
        level_margin, threshold_margin: The least of all readings, None without one.
        time: Time units from the first write to the end of the last.
    """
    try:
        climb = rerun(shared, values, seed)
    except SettingsError as error:
        return {
            'passed': False, 'reached': 0, 'failure': UNFIT, 'error': str(error), 'wall': None,
            'level_margin': None, 'threshold_margin': None, 'time': 0.0,
        }  # fmt: skip
    last = climb.writes[-1]
    return {
        'passed': climb.passed, 'reached': climb.reached, 'failure': climb.failure,
        'error': last.outcome.error, 'wall': last.wall if math.isfinite(last.wall) else None,
        **least_margins(each.outcome for each in climb.writes),
        'time': last.outcome.end_tick * shared['settings']['time']['tick'],
    }  # fmt: skip


LONG_TICK = 50.0
"""Tick of a map: longer ticks simulate faster."""


def prepared(settings: Settings, axes: Sequence[str], tick: float | None = None) -> Settings:
    """Return settings for a map: writes by steps alone, and with a tick.

    A write that could take a stroke instead of a step would hide the settings of the step.

    Args:
        settings: The instrument's.
        axes: Names of both axes. Strokes are kept if one of them is a stroke's.
        tick: In time units. By default `LONG_TICK` if all times of the steps are multiples of it
            and no stroke is kept: other schedules would change, and keep the instrument's tick.

    Raises:
        SettingsError: It is out of range.
    """
    write, strokes = settings.write, any(name.startswith(('up_', 'down_')) for name in axes)
    settings = settings if strokes else paper_way(settings)
    if tick is None:
        times = Cycle.planned(write, write.tension).motions
        whole = all(each.duration % LONG_TICK == 0.0 for each in times)
        tick = LONG_TICK if whole and not strokes else settings.time.tick
    return replace(settings, time=replace(settings.time, tick=tick))


@dataclass(frozen=True)
class Shmoo:
    """A pass/fail map of a design and its settings over two axes.

    Attributes:
        settings: The instrument's settings: the operating point.
        element: An element of the design with its pulses; None for one exactly as designed.
    """

    design: Design
    settings: Settings
    x: Axis
    y: Axis
    size: int = 64
    seed: int = 0
    element: Element | None = None

    def __post_init__(self) -> None:
        if self.x.name == self.y.name:
            raise ValueError(f'the axes must be two different ones; got {self.x.name} twice')
        if self.size < 2:
            raise ValueError(f'size must be at least 2; got {self.size}')

    @cached_property
    def x_values(self) -> Array:
        """Values along x, shape (size,)."""
        return self.x.values(self.size)

    @cached_property
    def y_values(self) -> Array:
        """Values along y, shape (size,)."""
        return self.y.values(self.size)

    @property
    def operating(self) -> tuple[int, int]:
        """Row and column of the operating point."""
        return (
            int(np.flatnonzero(self.y_values == self.y.operating)[0]),
            int(np.flatnonzero(self.x_values == self.x.operating)[0]),
        )

    def campaign(self) -> Campaign:
        """Return the points row by row, the first row at the least y; a write has one attempt."""
        points = [
            {self.x.name: float(x), self.y.name: float(y)}
            for y in self.y_values
            for x in self.x_values
        ]
        once = replace(self.settings, write=replace(self.settings.write, attempts=1))
        shared = Bench(self.design, once, self.element).as_dict()
        return Campaign('margins', evaluate, shared, points, self.seed)

    def grid(self, rows: Sequence[Row], name: str) -> Array:
        """Return a column of the complete table as a grid, shape (size, size), y by x."""
        return np.array([row[name] for row in rows]).reshape(self.size, self.size)
