# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Decode recorded echoes again, from their waveforms and without a device."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mlmem_ros.device import BLANK, Calibration, Settings
from mlmem_ros.device.echo import EchoDetector, pulse_duration
from mlmem_ros.device.end import End, Pulse
from mlmem_ros.device.reading import confidence
from mlmem_ros.device.settings import ProbeSettings
from mlmem_ros.session.data import RecordedEcho


@dataclass(frozen=True)
class Redecoded:
    """A recorded waveform, decoded again.

    Attributes:
        end: The probed end, identified by the pulse itself.
        delay: Delay of the first crossing, or None.
        level: The calibrated level nearest to the delay (-1 for blank), or None without an echo.
        level_margin: 1 on the calibrated delay, 0 half-way to the next.
        threshold_margin: Greatest v_c over the threshold.
    """

    end: End
    delay: float | None
    level: int | None
    level_margin: float
    threshold_margin: float

    @property
    def confidence(self) -> float:
        """From 0 to 1; see `device.reading.confidence`."""
        return confidence(self.level_margin, self.threshold_margin)

    def agrees(self, recorded: int | None) -> bool:
        """Whether this is the level that was published; true if none was, or it was undecodable.

        An echo alone does not show the phases of the ends, which can make it undecodable.
        """
        return recorded is None or recorded < BLANK or self.level == recorded


def redecode(echo: RecordedEcho, settings: Settings, calibration: Calibration) -> Redecoded:
    """Decode a recorded echo again, with the pulses and thresholds of the settings."""
    end = min(End, key=lambda end: _misfit(echo, end.probe(settings)))
    detector = EchoDetector(end.probe(settings), float(echo.t[1] - echo.t[0]))
    detector.take(echo.v_m)
    if detector.delay is None or end not in calibration.ends:
        return Redecoded(end, None, None, 0.0, detector.threshold_margin)
    level, margin = calibration.table(end).nearest(detector.delay)
    return Redecoded(end, detector.delay, level, margin, detector.threshold_margin)


def _misfit(echo: RecordedEcho, probe: ProbeSettings) -> float:
    """Return how much the start of a waveform differs from the pulse of an end, as it is heard."""
    heard = EchoDetector(probe, float(echo.t[1] - echo.t[0]))
    duration = pulse_duration(probe)
    heard.feed(np.where(echo.t <= duration, Pulse(0.0, probe).at(echo.t)[0], 0.0))
    n = int(np.searchsorted(echo.t, duration))
    pulse = heard.echo(End.LEFT).v_m[:n]
    return float(np.mean((echo.v_m[:n] - pulse[:n]) ** 2) / np.mean(pulse[:n] ** 2))
