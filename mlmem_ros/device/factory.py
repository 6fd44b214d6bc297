# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""New devices, calibrated on an ideal element of their design."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

from ..physics import Design, Specimen, StateError
from ..physics.equilibrium import blank, resting_wall
from ..physics.potential import Array
from .calibration import Calibration, DelayTable
from .decoding import primary
from .driver import Driver, Simulation
from .echo import Echo
from .element import MemoryElement
from .end import End
from .errors import ProcedureFailed, SettingsError
from .instrument import Instrument
from .presets import Preset
from .procedures.blocks import run, wait
from .procedures.listening import pulse_echo
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
    """Return the echo delays of an ideal element; raises as `calibration_of`."""
    return calibration_of(Specimen(design), design, settings)


def calibration_of(made: Specimen, design: Design, settings: Settings) -> Calibration:
    """Return the echo delays of an element in an instrument for a design, probed with its wall
    resting at every level.

    Always by the method whose waves do not depend on its step: delays are those of the element.

    Raises:
        SettingsError: A level gives no echo, or levels cannot be told apart by their echoes.
    """
    at_rest = replace(settings.read, rest=0.0)  # the ideal element is at rest
    converged = replace(settings.time, integrator='pefrl')
    body = Simulation.of(made, converged)
    twin = Instrument(design, replace(settings, read=at_rest, time=converged), body)
    walls = [_resting(made, level) for level in range(design.levels)]
    heard = [_echoes(twin, wall, tuple(End)) for wall in walls]
    for level, echoes in enumerate(heard):
        for end, echo in echoes.items():
            if echo.delay is None:
                probe = twin.transducer.probes[end]
                raise SettingsError(
                    f'level {level} gives no echo at the {end} end: with carrier '
                    f'{probe.omega_c:g} and threshold {probe.v_th:g} it cannot be read'
                )
    empty = _echoes(twin, blank(made), (End.RIGHT,))[End.RIGHT].delay
    left, right = (
        DelayTable(
            tuple(each[end].delay or 0.0 for each in heard),
            of_blank,
            tuple(each[end].shape for each in heard),
        )
        for end, of_blank in ((End.LEFT, None), (End.RIGHT, empty))
    )
    found = Calibration(left, right)
    found.check(design.levels, primary(settings.read))
    return found


def _resting(made: Specimen, level: int) -> Array:
    try:
        return resting_wall(made, level)
    except StateError as error:
        raise SettingsError(f'the wall does not settle at level {level}: {error}') from error


def _echoes(twin: Instrument, v: Array, ends: tuple[End, ...]) -> dict[End, Echo]:
    """Place a configuration, probe it once, and return the echoes at some ends."""
    twin.chain.place(v)
    twin.transducer.assume_rest()
    write = twin.settings.write
    try:
        if twin.design.substrate == 'elastic':  # the wall strains it: let it come to rest
            run(twin, wait(twin, write.settle + write.final_settle))
            twin.transducer.assume_rest()
        return run(twin, pulse_echo(twin, ends))
    except ProcedureFailed as error:
        raise SettingsError(f'the ideal element cannot be probed: {error}') from error
