# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""New devices, calibrated on an ideal element of their design."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from ..physics import Design, Specimen, StateError
from ..physics.equilibrium import resting_wall
from ..physics.potential import Array
from .calibration import Calibration, DelayTable
from .driver import Driver
from .element import MemoryElement
from .end import End, read_from
from .errors import ProcedureFailed, SettingsError
from .instrument import Instrument
from .presets import Preset
from .procedures.blocks import run, wait
from .procedures.listening import answer
from .settings import Settings


def new_element(
    design: Design | Preset,
    settings: Settings | None = None,
    calibration: Calibration | None = None,
    driver: Driver | None = None,
) -> MemoryElement:
    """Return a calibrated device, blank unless a driver has its own element.

    Args:
        design: The element; a preset includes its settings.
        settings: The instrument's settings, by default the preset's, or those for Case II.
        calibration: A known calibration for them; by default the factory's.
        driver: The driver of a real element; by default that of a simulated one.

    Raises:
        SettingsError: A level gives no echo, or levels cannot be told apart by their echoes.
        DesignError: The step is beyond the stability limit.
    """
    if isinstance(design, Preset):
        settings = settings or design.settings
        design = design.design
    settings = settings or Settings()
    calibration = calibration or factory_calibration(design, settings)
    return MemoryElement(design, settings, calibration, driver)


@lru_cache(maxsize=64)  # shared by equal instruments
def factory_calibration(design: Design, settings: Settings) -> Calibration:
    """Return the echo delays of an ideal element, probed with its wall resting at every level.

    The left end has none where `read.end` is 'right'.

    Raises:
        SettingsError: A level gives no echo, or levels cannot be told apart by their echoes.
    """
    at_rest = replace(settings.read, rest=0.0)  # the ideal element is at rest
    twin = Instrument(design, replace(settings, read=at_rest))
    walls = [_resting(design, level) for level in range(design.levels)]
    tables = {end: _delays(twin, walls, end) for end in read_from(settings)}
    left = DelayTable(tables[End.LEFT]) if End.LEFT in tables else None
    blank = _delay(twin, np.full(design.N, design.D_s1), End.RIGHT)
    return Calibration(left, DelayTable(tables[End.RIGHT], blank))


def _resting(design: Design, level: int) -> Array:
    try:
        return resting_wall(Specimen(design), level)
    except StateError as error:
        raise SettingsError(f'the wall does not settle at level {level}: {error}') from error


def _delays(twin: Instrument, walls: Sequence[Array], end: End) -> tuple[float, ...]:
    """Return the delay of each wall at an end."""
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


def _delay(twin: Instrument, v: Array, end: End) -> float | None:
    """Place a configuration, probe it once, and return the echo delay."""
    twin.chain.place(v)
    twin.transducer.settle()
    write = twin.settings.write
    try:
        if twin.design.substrate == 'elastic':  # the wall strains it: let it come to rest
            run(twin, wait(twin, write.settle + write.final_settle))
        return run(twin, answer(twin, end, 0.0)).delay
    except ProcedureFailed as error:
        raise SettingsError(f'the ideal element cannot be probed: {error}') from error
