# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A map: the points of a grid over two axes, each a device whose levels are written in turn, and
the result at each. An axis is any numeric setting, or the temperature.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from mlmem import Settings, SettingsError
from mlmem.element_file import Element
from mlmem.instrument.motion import Cycle
from mlmem.moves.planner import disable_kicks
from mlmem.physics import Design
from mlmem.physics.potential import Array
from mlmem.schema import find_descriptions

from ..bench import Bench
from ..campaign import Campaign, Row
from ..campaign.campaign import Values
from ..trace import Climb, Heat, least_margins, write_upward

NOISE_AXIS = 'noise'
"""The axis that is not a setting: temperature k_B T of the metamaterial, in k_r cells^2."""

RAMPS_AXIS = 'ramps'
"""The axis that sets `write.ramp` and `write.release` alike."""


AXIS_RANGES = {
    'write.compression': (0.3, 2.3),
    'write.tension': (0.3, 1.7),
    'write.start_strain': (0.0, 2.0),
    'write.launch_speed': (0.1, 20.0),
    RAMPS_AXIS: (0.01, 2.0),
    'write.ramp': (0.01, 2.0),
    'write.release': (0.01, 2.0),
    'write.hold': (0.0, 2.0),
    'write.settle': (0.0, 2.0),
    'probe.v_th': (0.1, 10.0),
    'probe.omega_c': (0.8, 1.1),
}
"""Default ranges of maps, as factors on the operating value."""

OTHER_AXIS_RANGE = (0.5, 1.5)
"""The range of any other setting."""

NOISE_RANGE = (1e-12, 1e-6)

LOGARITHMIC_AXES = ('write.launch_speed', 'probe.v_th', NOISE_AXIS)
"""Axes whose values are evenly spaced in their logarithm."""


@dataclass(frozen=True)
class Axis:
    """One direction of a map.

    Attributes:
        name: Name of a setting as 'write.hold', or `RAMPS_AXIS`, or `NOISE_AXIS`.
        unit: Unit; empty for ratios.
        operating: Value in the settings under study.
        log: Whether its values are evenly spaced in their logarithm.
    """

    name: str
    text: str
    unit: str
    operating: float
    low: float
    high: float
    log: bool

    def values(self, size: int) -> Array:
        """Return the values of a map, shape (size,), rising.

        The one nearest to the operating value is replaced by it, so that a line of the map passes
        exactly through the operating point.
        """
        spaced = (np.geomspace if self.log else np.linspace)(self.low, self.high, size)
        values = np.array([float(f'{value:.6g}') for value in spaced])
        values[np.abs(values - self.operating).argmin()] = self.operating
        return values


def make_axis(name: str, settings: Settings, span: tuple[float, float] | None = None) -> Axis:
    """Return an axis about the operating value of some settings.

    Args:
        span: Where the map begins and ends; by default `AXIS_RANGES` times the operating value, or
            `NOISE_RANGE`.

    Raises:
        ValueError: There is no such setting, or the range lacks the operating value.
    """
    text, unit, operating = _describe_axis(name, settings)
    if span is None:
        span = NOISE_RANGE if name == NOISE_AXIS else _default_span(name, operating, settings)
    low, high = sorted(span)
    inside = low <= operating <= high or name == NOISE_AXIS
    if not (math.isfinite(low) and math.isfinite(high) and low < high and inside):
        raise ValueError(
            f'the range of {name} must be two numbers with the operating value '
            f'{operating:g} between them; got {span[0]:g} and {span[1]:g}'
        )
    log = name in LOGARITHMIC_AXES
    if log and low <= 0.0:
        raise ValueError(f'the range of {name} must be above 0; got {low:g}')
    return Axis(name, text, unit, operating, low, high, log)


def _default_span(name: str, operating: float, settings: Settings) -> tuple[float, float]:
    low, high = sorted(factor * operating for factor in AXIS_RANGES.get(name, OTHER_AXIS_RANGE))
    if name in ('write.compression', 'write.tension', 'write.start_strain'):
        limit = settings.actuator.max_strain
        return max(low, -limit), min(high, limit)
    if name in (RAMPS_AXIS, 'write.ramp', 'write.release'):
        return max(low, 1.0), high
    return low, high


def _describe_axis(name: str, settings: Settings) -> tuple[str, str, float]:
    """Return text, unit and operating value of an axis."""
    if name == NOISE_AXIS:
        return 'temperature of the cells, k_B T', 'k_r cells^2', 0.0
    if name == RAMPS_AXIS:
        return 'ramp to the peak strain, and back', 'time', settings.write.ramp
    group, _, key = name.partition('.')
    for field, description in find_descriptions(settings.groups().get(group, settings)):
        value = getattr(settings.groups()[group], field.name)
        if field.name == key and isinstance(value, float):
            return description.text, description.unit, value
    known = ', '.join((*AXIS_RANGES, NOISE_AXIS))
    raise ValueError(f'an axis must be a numeric setting, such as {known}; got {name!r}')


def with_values(settings: Settings, values: Mapping[str, Any]) -> tuple[Settings, float]:
    """Return the settings at a point, and its temperature.

    Raises:
        SettingsError: A value is out of range.
    """
    groups: dict[str, dict[str, float]] = {}
    temperature = 0.0
    for name, value in values.items():
        if name == NOISE_AXIS:
            temperature = value
            continue
        for setting in ('write.ramp', 'write.release') if name == RAMPS_AXIS else (name,):
            group, _, key = setting.partition('.')
            groups.setdefault(group, {})[key] = value
    changed = {name: replace(settings.groups()[name], **new) for name, new in groups.items()}
    return replace(settings, **changed), temperature  # type: ignore[arg-type]


UNFIT_FAILURE = 'unfit'
"""Failure of settings that give no device: no echo, or out of range."""


def rerun_point(shared: Values, values: Values, seed: int) -> Climb:
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


def evaluate_point(shared: Values, values: Values, seed: int) -> Row:
    """Return the results of one point, as numbers and words.

    Returns:
        passed: Whether every level was written and read back.
        reached: How many were, from level 0 up.
        failure: '' or the reason: see `WrittenLevel.failure`, and `UNFIT_FAILURE`.
        error: What the device said.
        wall: True position of the wall at the end, None for none or several.
        level_margin, threshold_margin: The least of all readings, None without one.
        time: Time units from the first write to the end of the last.
    """
    try:
        climb = rerun_point(shared, values, seed)
    except SettingsError as error:
        return {
            'passed': False,
            'reached': 0,
            'failure': UNFIT_FAILURE,
            'error': str(error),
            'wall': None,
            'level_margin': None,
            'threshold_margin': None,
            'time': 0.0,
        }
    last = climb.writes[-1]
    return {
        'passed': climb.passed, 'reached': climb.reached, 'failure': climb.failure,
        'error': last.outcome.error, 'wall': last.wall if math.isfinite(last.wall) else None,
        **least_margins(each.outcome for each in climb.writes),
        'time': last.outcome.end_tick * shared['settings']['time']['tick'],
    }  # fmt: skip


LONG_TICK = 50.0
"""Tick of a map: longer ticks simulate faster."""


def prepare_settings(settings: Settings, tick: float | None = None) -> Settings:
    """Return settings for a map: writes by strain, and with a tick.

    Args:
        settings: The instrument's.
        tick: In time units. By default `LONG_TICK` if all times of the steps are multiples of it:
            other schedules would change, and keep the instrument's tick.

    Raises:
        SettingsError: It is out of range.
    """
    settings = disable_kicks(settings)
    if tick is None:
        times = Cycle.plan_cycle(settings.write, settings.write.tension).motions
        whole = all(each.duration % LONG_TICK == 0.0 for each in times)
        tick = LONG_TICK if whole else settings.time.tick
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
        return Campaign('margins', evaluate_point, shared, points, self.seed)

    def build_grid(self, rows: Sequence[Row], name: str) -> Array:
        """Return a column of the complete table as a grid, shape (size, size), y by x."""
        return np.array([row[name] for row in rows]).reshape(self.size, self.size)
