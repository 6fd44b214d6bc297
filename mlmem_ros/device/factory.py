# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A device as it leaves the factory: calibrated on an ideal element of its design."""

from __future__ import annotations

import math

import numpy as np

from ..physics import Design, StateError
from ..physics.equilibrium import resting_wall
from .calibration import Calibration, DelayTable
from .commands import Read
from .element import MemoryElement
from .errors import SettingsError
from .events import Heard
from .settings import Settings


def new_element(
    design: Design, settings: Settings | None = None, calibration: Calibration | None = None
) -> MemoryElement:
    """Return a blank device, calibrated.

    Args:
        design: The element.
        settings: The instrument's settings, by default those for the paper's Case II.
        calibration: One that is known for them; by default that of the factory.

    Raises:
        SettingsError: A level gives no echo, or levels cannot be told apart by their echoes.
        DesignError: The step is beyond the stability limit.
    """
    settings = settings or Settings()
    calibration = calibration or factory_calibration(design, settings)
    return MemoryElement(design, settings, calibration)


def factory_calibration(design: Design, settings: Settings) -> Calibration:
    """Return the echo delays of an ideal element, probed with its wall resting at every level.

    Raises:
        SettingsError: A level gives no echo, or levels cannot be told apart by their echoes.
    """
    unknown = DelayTable(tuple(level + 1.0 for level in range(design.levels)))
    twin = MemoryElement(design, settings, Calibration(unknown, unknown))
    delays: dict[str, list[float]] = {'left': [], 'right': []}
    for level in range(design.levels):
        try:
            wall = resting_wall(design, level)
        except StateError as error:
            raise SettingsError(f'the wall finds no rest at level {level}: {error}') from error
        for end, known in delays.items():
            delay = _delay(twin, wall, end)
            if delay is None:
                raise SettingsError(
                    f'level {level} gives no echo at the {end} end: with carrier '
                    f'{twin.transducer.probes[end].omega_c:g} and threshold '
                    f'{twin.transducer.probes[end].v_th:g} it cannot be read'
                )
            known.append(delay)
    blank = _delay(twin, np.full(design.N, design.D_s1), 'right')
    return Calibration(
        DelayTable(tuple(delays['left'])), DelayTable(tuple(delays['right']), blank)
    )


def _delay(twin: MemoryElement, v: np.ndarray, end: str) -> float | None:
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
