# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a configuration makes: the device of a checked design, and its files."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import replace
from typing import NamedTuple

from mlmem import (
    Calibration,
    DriverError,
    ErrorCode,
    MemoryElement,
    SettingsError,
    calibration_key,
    compute_calibration,
    factory_calibration,
    open_driver,
)
from mlmem.element_file import Element, read_matching_element
from mlmem.procedure_table import UNSET_CONTENT

from .design_check import check_design
from .settings import Parameters, name_rejections
from .store import Store, find_calibration
from .worker import ThrottledLog, Worker


class Built(NamedTuple):
    """A device, and what keeps its state."""

    element: MemoryElement
    store: Store


def build_device(
    given: Parameters, log: ThrottledLog, disk: Worker, name: str, blank: bool
) -> Built:
    """Check the design, open the driver, build the device, restore its content unless `blank`.

    Raises:
        One of `REFUSALS`: Nothing is open.
    """
    twin = _load_twin(given, disk)
    if twin is not None:
        known = given.settings.add_stuck_cells(twin.specimen.stuck)
        given = replace(given, settings=twin.apply_planned_kicks(known))
    loudest = check_design(given.design, given.settings, given.check, log)
    with ExitStack() as undo:
        try:
            driver = open_driver(
                given.device.driver, given.device.address, given.design, given.settings,
                given.specimen,
            )  # fmt: skip
        except (DriverError, SettingsError) as error:
            log.log_cause(error)
            raise
        undo.callback(driver.close)
        store = Store(given.state, given.files, log, disk, name)
        undo.callback(store.close)
        saved = store.load_state()
        key = calibration_key(given.design, given.settings)
        calibration = find_calibration(saved, key, given.design.levels)
        element = MemoryElement(given.design, given.settings, calibration, driver)
        element.loudest = loudest
        if twin is not None:
            attach_twin(element, twin, log)
        with name_rejections():
            element.specimen(given.faults)
        if given.initial_content != UNSET_CONTENT:
            place_initial_content(element, given.initial_content)
        if not blank:
            store.restore_state(element, saved)
        undo.pop_all()
    return Built(element, store)


def place_initial_content(element: MemoryElement, content: int) -> None:
    """Put the walls of a level or word into a new simulated element, at rest.

    The content is not known until a read.

    Raises:
        SettingsError: The element is real, has no such content, or its walls do not rest there.
    """
    if not element.is_simulated:
        expected = f'{UNSET_CONTENT} for a real element'
        raise SettingsError(ErrorCode.UNSUPPORTED, 'initial_content', content, expected)
    if content >= (count := element.reader.content_count):
        expected = f'from 0 to {count - 1}'
        raise SettingsError.out_of_range('initial_content', content, expected)
    with name_rejections(f'initial_content {content}'):
        element.place_content(content)


def _load_twin(given: Parameters, disk: Worker) -> Element | None:
    """Return the element in the file of the twin, or None without one."""
    if not given.twin:
        return None
    planned = given.settings if given.settings.holds_words else None

    def read_twin() -> Element:
        with name_rejections('twin'):
            path = given.files.confine_path(given.twin)
            return read_matching_element(path, given.design, planned)

    return disk.do_and_wait(f'reading {given.twin}', read_twin)


def attach_twin(element: MemoryElement, twin: Element, log: ThrottledLog) -> None:
    """Let a twin forecast the answers of its element.

    Raises:
        SettingsError: The twin does not hold every word of a register, or every level of a wall
            that is read by waveform.
    """
    settings = element.settings
    if settings.compares_waveforms and not settings.element.bad_cells:
        with name_rejections('twin'):
            element.adopt_twin(twin.timed_specimen)
    else:
        element.forecast = _forecast_calibration(element, twin, log)


def _forecast_calibration(element: MemoryElement, twin: Element, log: ThrottledLog) -> Calibration:
    """Return the calibration that a twin forecasts: delays of its echoes, and planned pulses."""
    design, settings = element.design, element.settings
    try:
        healthy = replace(twin.timed_specimen, stuck=())  # with bad cells no delays are heard
        delays = compute_calibration(healthy, design, settings)
    except SettingsError as error:
        log.warning(f'twin: {error}; delays are those of the design')
        delays = factory_calibration(design, settings)
    return replace(delays, pulse_corrections=twin.plan)
