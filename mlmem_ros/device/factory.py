# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A device as it leaves the factory: calibrated on an ideal element of its design."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..physics import Design, Specimen, StateError
from ..physics.equilibrium import resting_wall
from ..physics.potential import Array
from .calibration import Calibration, DelayTable
from .commands import Read
from .element import MemoryElement
from .errors import SettingsError
from .events import Heard
from .presets import Preset
from .settings import Settings


def new_element(
    design: Design | Preset,
    settings: Settings | None = None,
    calibration: Calibration | None = None,
) -> MemoryElement:
    """Return a blank device, calibrated.

    Args:
        design: The element; a preset brings its settings along.
        settings: The instrument's settings, by default the preset's, or those for Case II.
        calibration: One that is known for them; by default that of the factory.

    Raises:
        SettingsError: A level gives no echo, or levels cannot be told apart by their echoes.
        DesignError: The step is beyond the stability limit.
    """
    if isinstance(design, Preset):
        settings = settings or design.settings
        design = design.design
    settings = settings or Settings()
    calibration = calibration or factory_calibration(design, settings)
    return MemoryElement(design, settings, calibration)


def factory_calibration(design: Design, settings: Settings) -> Calibration:
    """Return the echo delays of an ideal element, probed with its wall resting at every level.

    The left end has none where `read.end` is 'right'.

    Raises:
        SettingsError: A level gives no echo, or levels cannot be told apart by their echoes.
    """
    unknown = DelayTable(tuple(level + 1.0 for level in range(design.levels)))
    at_rest = replace(settings.read, rest=0.0)  # as the ideal element is: no wait is needed
    settings = replace(settings, read=at_rest)
    twin = MemoryElement(design, settings, Calibration(unknown, unknown))
    walls = [_resting(design, level) for level in range(design.levels)]
    left = None if settings.read.end == 'right' else DelayTable(_delays(twin, walls, 'left'))
    blank = _delay(twin, np.full(design.N, design.D_s1), 'right')
    return Calibration(left, DelayTable(_delays(twin, walls, 'right'), blank))


def _resting(design: Design, level: int) -> Array:
    try:
        return resting_wall(Specimen(design), level)
    except StateError as error:
        raise SettingsError(f'the wall finds no rest at level {level}: {error}') from error


def _delays(twin: MemoryElement, walls: Sequence[Array], end: str) -> tuple[float, ...]:
    """Return the delays of walls at an end."""
    delays = []
    for level, wall in enumerate(walls):
        delay = _delay(twin, wall, end)
        if delay is None:
            raise SettingsError(
                f'level {level} gives no echo at the {end} end: with carrier '
                f'{twin.transducer.probes[end].omega_c:g} and threshold '
                f'{twin.transducer.probes[end].v_th:g} it cannot be read'
            )
        delays.append(delay)
    return tuple(delays)


def _delay(twin: MemoryElement, v: Array, end: str) -> float | None:
    """Place a configuration, probe it once, and return the echo delay."""
    twin.chain.place(v)
    twin.transducer.settle()
    if twin.design.substrate == 'elastic':  # which the wall pulls at: let that come to rest
        write = twin.settings.write
        for _ in range(math.ceil((write.settle + write.final_settle) / twin.tick)):
            twin.advance()
    twin.apply(Read(end))
    while True:
        for event in twin.advance():
            if isinstance(event, Heard):
                return event.echo.delay
            raise SettingsError(f'the ideal element cannot be probed: {event.error}')
