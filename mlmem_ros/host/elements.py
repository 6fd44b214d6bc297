# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The files of fitted elements: what a node simulates, and what it knows its element to be."""

from __future__ import annotations

from dataclasses import replace

from ..device import Calibration, Settings, SettingsError
from ..device.factory import calibration_of, factory_calibration
from ..element_file import Element, ElementFileError, of_design
from ..physics import Design
from .files import FileSettings
from .throttled_log import ThrottledLog


def opened(name: str, path: str, files: FileSettings, design: Design) -> Element:
    """Return the element in the file that the parameter `device.NAME` names.

    Raises:
        SettingsError: There is no such element, or it has other cells and defects.
    """
    try:
        return of_design(files.confined(path), design)
    except (ElementFileError, SettingsError) as error:
        raise SettingsError(f'device.{name}: {error}') from error


def forecast(twin: Element, design: Design, settings: Settings, log: ThrottledLog) -> Calibration:
    """Return the calibration that a twin forecasts: delays of its echoes, and planned pulses."""
    try:
        delays = calibration_of(twin.timed, design, settings)
    except SettingsError as error:
        log.warning(f'device.twin: {error}; delays are those of the design')
        delays = factory_calibration(design, settings)
    return replace(delays, trims=twin.plan)
