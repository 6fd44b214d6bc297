# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What is known of an element before it is used: the delays of an ideal one of its design, and the
levels that known bad cells leave.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING

from .errors import ErrorCode, ProcedureFailed, SettingsError
from .instrument.blocks import run, wait
from .instrument.drivers import Simulation
from .instrument.echo import Echo
from .instrument.end import End
from .instrument.instrument import Instrument
from .memory import Memory
from .physics import Design, Specimen, StateError
from .physics.equilibrium import find_pinned_wall, make_blank
from .physics.values import Array
from .procedures.writing import erase, write
from .readers.calibration import Calibration, DelayTable
from .readers.listening import probe_ends
from .readers.reading import BLANK
from .settings import ElementSettings, Settings

if TYPE_CHECKING:
    from .readers.bad_cells import BadCells


@lru_cache(maxsize=64)  # shared by equal instruments
def factory_calibration(design: Design, settings: Settings) -> Calibration:
    """Return the echo delays of an ideal element; raises as `compute_calibration`. For one that is
    read by waveform, the travel times; raises as `estimate_travel_times`.
    """
    if settings.read.method != 'delay':
        from .readers.one_wall import estimate_travel_times  # most are read by delays

        return estimate_travel_times(design, settings)
    return compute_calibration(Specimen(design), design, settings)


def compute_calibration(made: Specimen, design: Design, settings: Settings) -> Calibration:
    """Return the echo delays of an element in an instrument for a design, probed with its wall
    resting at every level.

    Raises:
        SettingsError: A level gives no echo, or levels cannot be told apart by their echoes.
    """
    at_rest = replace(settings.read, rest=0.0)  # the ideal element is at rest
    body = Simulation.build_blank(made, settings.time)
    twin = Instrument(design, replace(settings, read=at_rest), body)
    walls = [_relax_wall(made, level) for level in range(design.levels)]
    heard = [_measure_echoes(twin, wall, tuple(End)) for wall in walls]
    for level, echoes in enumerate(heard):
        for end, echo in echoes.items():
            if echo.delay is None:
                probe = twin.transducer.probes[end]
                expected = (
                    f'one with an echo at the {end} end, where carrier {probe.omega_c:g} and '
                    f'threshold {probe.v_th:g} give none'
                )
                raise SettingsError(ErrorCode.UNSUPPORTED, 'level', level, expected)
    empty = _measure_echoes(twin, make_blank(made), (End.RIGHT,))[End.RIGHT].delay
    left, right = (
        DelayTable(
            tuple(each[end].delay or 0.0 for each in heard),
            empty if end is End.RIGHT else None,
            tuple(each[end].shape for each in heard),
        )
        for end in End
    )
    found = Calibration(left, right)
    found.check(design.levels, settings.read.primary_end)
    return found


def _relax_wall(made: Specimen, level: int) -> Array:
    try:
        return find_pinned_wall(made, level)
    except StateError as error:
        expected = f'one at which a wall settles ({error})'
        raise SettingsError(ErrorCode.UNSUPPORTED, 'level', level, expected) from error


def _measure_echoes(twin: Instrument, v: Array, ends: tuple[End, ...]) -> dict[End, Echo]:
    """Place a configuration, probe it once, and return the echoes at some ends."""
    twin.chain.place(v)
    twin.transducer.assume_equilibrium()
    write = twin.settings.write
    try:
        if twin.design.substrate == 'elastic':  # the wall strains it: let it come to rest
            run(twin, wait(twin, write.settle + write.final_settle))
            twin.transducer.assume_equilibrium()
        return run(twin, probe_ends(twin, ends))
    except ProcedureFailed as error:
        raise SettingsError.of_error(error, 'probe', code=ErrorCode.UNSUPPORTED) from error


@lru_cache(maxsize=8)
def rehearse_levels(design: Design, settings: Settings) -> BadCells:
    """Return the forecasts with the known bad cells, and which levels can be used.

    A weak cell holds a wall that should pass, or lets go one that should rest. So where one is
    known, every level is written, from that below, and left in a simulation.

    Raises:
        SettingsError: As `forecast_bad_cells`.
    """
    from .readers.bad_cells import add_bad_cells, forecast_bad_cells  # few elements have bad cells
    from .readers.register import pin_walls

    found, weak = forecast_bad_cells(design, settings), settings.element.weak_factors
    if not weak:
        return found
    plain = replace(settings, element=ElementSettings())
    made = add_bad_cells(design, settings)
    once = replace(settings, write=replace(settings.write, attempts=1))
    body = Simulation.build_blank(made, settings.time)
    twin = Memory(design, once, factory_calibration(design, plain), body, found)
    lost: dict[int, str] = {}
    for level in found.usable:
        site = min(weak, key=lambda site: abs(site - design.defect_site(level)))
        below = max((n for n in found.usable if n < level and n not in lost), default=BLANK)
        ways = (below, write, (level,)), (level, erase, ()), (level, write, (max(0, below),))
        for start, way, target in ways:
            twin.replace_element()
            twin.chain.place(pin_walls(made, (start,) if start >= 0 else ()))
            twin.transducer.assume_equilibrium()
            try:
                run(twin, way(twin, *target))
            except (ProcedureFailed, StateError):  # there is no way, or a cell left its range
                lost[level] = f'cannot be reached: cell {site} has {weak[site]:g} of its stiffness'
                break
    return replace(found, lost={**found.lost, **lost})
