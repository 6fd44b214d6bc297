# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The axes of a map: any numeric setting, and the temperature."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mlmem_ros.described import descriptions
from mlmem_ros.device import Settings
from mlmem_ros.physics.potential import Array

NOISE = 'noise'
"""The axis that is not a setting: temperature k_B T of the metamaterial, in k_r cells^2."""

RAMPS = 'ramps'
"""The axis that sets `write.ramp` and `write.release` alike."""


AXES = {
    'write.compression': (0.3, 2.3),
    'write.tension': (0.3, 1.7),
    'write.start_strain': (0.0, 2.0),
    'write.launch_speed': (0.1, 20.0),
    RAMPS: (0.01, 2.0),
    'write.ramp': (0.01, 2.0),
    'write.release': (0.01, 2.0),
    'write.hold': (0.0, 2.0),
    'write.settle': (0.0, 2.0),
    'probe.v_th': (0.1, 10.0),
    'probe.omega_c': (0.8, 1.1),
}
"""Default ranges of maps, as factors on the operating value."""

OTHER = (0.5, 1.5)
"""The range of any other setting."""

NOISE_RANGE = (1e-12, 1e-6)

LOGARITHMIC = ('write.launch_speed', 'probe.v_th', NOISE)
"""Axes whose values are evenly spaced in their logarithm."""


@dataclass(frozen=True)
class Axis:
    """One direction of a map.

    Attributes:
        name: Name of a setting as 'write.hold', or `RAMPS`, or `NOISE`.
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
        span: Where the map begins and ends; by default `AXES` times the operating value, or
            `NOISE_RANGE`.

    Raises:
        ValueError: There is no such setting, or the range lacks the operating value.
    """
    text, unit, operating = _describe(name, settings)
    if span is None:
        span = NOISE_RANGE if name == NOISE else _default_span(name, operating, settings)
    low, high = sorted(span)
    inside = low <= operating <= high or name == NOISE
    if not (math.isfinite(low) and math.isfinite(high) and low < high and inside):
        raise ValueError(
            f'the range of {name} must be two numbers with the operating value '
            f'{operating:g} between them; got {span[0]:g} and {span[1]:g}'
        )
    log = name in LOGARITHMIC
    if log and low <= 0.0:
        raise ValueError(f'the range of {name} must be above 0; got {low:g}')
    return Axis(name, text, unit, operating, low, high, log)


def _default_span(name: str, operating: float, settings: Settings) -> tuple[float, float]:
    low, high = sorted(factor * operating for factor in AXES.get(name, OTHER))
    if name in ('write.compression', 'write.tension', 'write.start_strain'):
        limit = settings.actuator.max_strain
        return max(low, -limit), min(high, limit)
    if name in (RAMPS, 'write.ramp', 'write.release'):
        return max(low, 1.0), high
    return low, high


def _describe(name: str, settings: Settings) -> tuple[str, str, float]:
    """Return text, unit and operating value of an axis."""
    if name == NOISE:
        return 'temperature of the cells, k_B T', 'k_r cells^2', 0.0
    if name == RAMPS:
        return 'ramp to the peak strain, and back', 'time', settings.write.ramp
    group, _, key = name.partition('.')
    for field, description in descriptions(settings.groups().get(group, settings)):
        value = getattr(settings.groups()[group], field.name)
        if field.name == key and isinstance(value, float):
            return description.text, description.unit, value
    known = ', '.join((*AXES, NOISE))
    raise ValueError(f'an axis must be a numeric setting, such as {known}; got {name!r}')


def with_values(settings: Settings, values: Mapping[str, Any]) -> tuple[Settings, float]:
    """Return the settings at a point, and its temperature.

    Raises:
        SettingsError: A value is out of range.
    """
    groups: dict[str, dict[str, float]] = {}
    temperature = 0.0
    for name, value in values.items():
        if name == NOISE:
            temperature = value
            continue
        for setting in ('write.ramp', 'write.release') if name == RAMPS else (name,):
            group, _, key = setting.partition('.')
            groups.setdefault(group, {})[key] = value
    changed = {name: replace(settings.groups()[name], **new) for name, new in groups.items()}
    return replace(settings, **changed), temperature  # type: ignore[arg-type]
