# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Forecast of a device's echo, from the linear waves of its element, without simulation."""

from __future__ import annotations

import math

import numpy as np

from ..device.echo import Echo, EchoDetector, listening_time
from ..device.end import End
from ..device.pulse import Pulse
from ..device.settings import ProbeSettings
from ..physics import NOH_BATHE, Design, Integrator, Specimen
from ..physics.potential import Array
from .scattering import echo_response

BANDWIDTH = 5.0
"""Frequencies within this many 1 / sigma of the carrier are followed: the pulse has no others."""


SAMPLING = 0.25
"""Time units between samples if the device's own steps are shorter."""


def forecast_echo(
    design: Design,
    v: Array,
    probe: ProbeSettings,
    end: End,
    dt: float,
    integrator: Integrator = NOH_BATHE,
) -> Echo:
    """Return what a device hears of a resting, unstrained element.

    Only the first echo: not the ring-down of the released end, nor multiple reflections.

    Args:
        design: The element.
        v: Its displacements at rest, shape (N,).
        probe: Pulse and detector.
        end: Which.
        dt: Step of the device.
        integrator: How it steps: this damps and slows the wave a little (see
            `Integrator.squared_frequency`).
    """
    sampling = max(dt, SAMPLING)
    samples = math.ceil(listening_time(design, probe, end) / sampling)
    period = 2 * samples  # so that later arrivals are not aliased
    t = np.arange(1.0, period + 1.0) * sampling
    pulse = Pulse(0.0, probe)
    driven = np.where(t <= pulse.duration, pulse.at(t)[0], 0.0)
    omega = 2.0 * math.pi / (period * sampling) * np.arange(samples + 1)
    used = (np.abs(omega - probe.omega_c) < BANDWIDTH / probe.sigma) & (omega > 0.0)
    spectrum = np.where(used, np.fft.rfft(driven), 0.0)
    spectrum[used] *= echo_response(Specimen(design), v, omega[used], end, dt, integrator)
    detector = EchoDetector(probe, sampling)
    detector.feed(np.fft.irfft(spectrum, period)[:samples])
    return detector.echo(end)
