# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a configuration makes: the device of a checked design, its files, and what watches it."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

from ..device import (
    DriverError,
    Faults,
    MemoryElement,
    Refused,
    SettingsError,
    drivers,
)
from .design_check import check_design
from .settings import Parameters
from .store import NullStore
from .worker import ThrottledLog, Worker

if TYPE_CHECKING:
    from ..element_file import Element
    from .store import Store
    from .twins import ResidualMonitor


class Built(NamedTuple):
    """A device, what keeps its state, and what compares its reads with a twin's forecast."""

    element: MemoryElement
    store: Store | NullStore
    watcher: ResidualMonitor | None


def built(given: Parameters, log: ThrottledLog, disk: Worker, name: str, blank: bool) -> Built:
    """Check the design, open the driver, build the device, restore its content unless `blank`.

    Raises:
        One of `REFUSALS`: Nothing is open.
    """
    twin = _known('twin', given.device.twin, given, disk)
    if twin is not None:
        known = given.settings.with_stuck(twin.specimen.stuck)
        given = replace(given, settings=twin.kicks(known))
    loudest = check_design(given.design, given.settings, given.check, log)
    with ExitStack() as undo:
        specimen = _known('specimen', given.device.specimen, given, disk)
        try:
            driver = drivers.opened(
                given.device.driver, given.device.address, given.design, given.settings,
                specimen.timed if specimen else None,
            )  # fmt: skip
        except (DriverError, SettingsError) as error:
            log.cause(error)
            raise
        undo.callback(driver.close)
        store = _store(given, log, disk, name)
        undo.callback(store.close)
        element = store.new_element(given.design, given.settings, driver)
        element.loudest = loudest
        watcher = None
        if twin is not None:
            from .twins import beside  # most nodes have none

            watcher = beside(element, twin, log)
        _check_faults(element, given.faults)
        if not blank:
            store.restore(element)
        undo.pop_all()
    return Built(element, store, watcher)


def _known(name: str, path: str, given: Parameters, disk: Worker) -> Element | None:
    """Return the element in the file of a parameter, or None without one."""
    if not path:
        return None
    from ..element_file import ElementFileError, of_design  # most nodes have none

    planned = given.settings if name == 'twin' and given.settings.register.spacing else None

    def opened() -> Element:
        try:
            return of_design(given.files.confined(path), given.design, planned)
        except (ElementFileError, SettingsError) as error:
            raise SettingsError(f'device.{name}: {error}') from error

    return disk.done(f'reading {path}', opened)


def _store(given: Parameters, log: ThrottledLog, disk: Worker, name: str) -> Store | NullStore:
    if not given.state.path:
        return NullStore(disk)
    from .store import Store

    return Store(given.state, given.files, log, disk, name)


def _check_faults(element: MemoryElement, faults: Faults) -> None:
    try:
        element.specimen(faults)
    except Refused as refusal:
        raise SettingsError(f'parameters {refusal}') from refusal
