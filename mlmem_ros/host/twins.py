# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a twin is for: it forecasts what its element answers, and tells what has changed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Protocol

from ..device import Calibration, Event, MemoryElement, SettingsError, factory_calibration
from ..device.factory import calibration_of
from ..packages import tool

if TYPE_CHECKING:
    from ..element_file import Element
    from .worker import ThrottledLog


class ResidualMonitor(Protocol):
    """Compares every clean read with the forecast of a twin (`mlmem_tools.twin.watcher`)."""

    text: str
    """What has changed, in words; empty as long as all is as forecast."""

    def hear(self, events: Sequence[Event]) -> None:
        """Take the events of a tick, in the loop's thread."""

    def values(self) -> dict[str, Any]:
        """Return values for diagnostics, by name."""


def beside(element: MemoryElement, twin: Element, log: ThrottledLog) -> ResidualMonitor:
    """Let a twin forecast the answers of its element; return what compares these.

    Raises:
        SettingsError: The twin does not hold every word of a register.
    """
    if element.register is None:
        element.forecast = _calibration(element, twin, log)
    else:
        try:
            element.adopt(twin.timed)
        except SettingsError as error:
            raise SettingsError(f'device.twin: {error}') from error
    monitor: ResidualMonitor = tool('residual_monitor').load()(twin, element, log)
    return monitor


def _calibration(element: MemoryElement, twin: Element, log: ThrottledLog) -> Calibration:
    """Return the calibration that a twin forecasts: delays of its echoes, and planned pulses."""
    design, settings = element.design, element.settings
    try:
        healthy = replace(twin.timed, stuck=())  # with bad cells no delays are heard
        delays = calibration_of(healthy, design, settings)
    except SettingsError as error:
        log.warning(f'device.twin: {error}; delays are those of the design')
        delays = factory_calibration(design, settings)
    return replace(delays, trims=twin.plan)
