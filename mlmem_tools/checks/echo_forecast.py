# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Forecast of a device's echo, from small waves on its resting element, without simulation.

The equation of motion (1a), linearised about the resting configuration, is a three-term recursion
in j for every frequency. Its solution from the far end includes all effects of wall, defects,
gradient and damping on a wave, with no approximation but linearity.
"""

from __future__ import annotations

import math

import numpy as np

from mlmem_ros.device.echo import Echo, EchoDetector, listening_time
from mlmem_ros.device.end import End, Pulse
from mlmem_ros.device.settings import ProbeSettings
from mlmem_ros.physics import PEFRL, Design, Integrator, Specimen
from mlmem_ros.physics.methods.integrator import Complex
from mlmem_ros.physics.potential import Array

BANDWIDTH = 5.0
"""Frequencies within this many 1 / sigma of the carrier are followed: the pulse has no others."""

SAMPLING = 0.25
"""Time units between samples if the device's own steps are shorter."""


def forecast_echo(
    made: Design | Specimen,
    v: Array,
    probe: ProbeSettings,
    end: End,
    dt: float,
    integrator: Integrator = PEFRL,
) -> Echo:
    """Return what a device hears of a resting, unstrained element.

    Only the first echo: not the ring-down of the released end, nor multiple reflections.

    Args:
        v: Its displacements at rest, shape (N,).
        probe: Pulse and detector.
        dt: Step of the device.
        integrator: Its method, which damps and slows the wave a little (see
            `Integrator.squared_frequency`).
    """
    made, sampling = Specimen.of(made), max(dt, SAMPLING)
    samples = math.ceil(listening_time(made.design, probe, end) / sampling)
    period = 2 * samples  # so that later arrivals are not aliased
    t = np.arange(1.0, period + 1.0) * sampling
    pulse = Pulse(0.0, probe)
    driven = np.where(t <= pulse.duration, pulse.at(t)[0], 0.0)
    omega = 2.0 * math.pi / (period * sampling) * np.arange(samples + 1)
    used = (np.abs(omega - probe.omega_c) < BANDWIDTH / probe.sigma) & (omega > 0.0)
    spectrum = np.where(used, np.fft.rfft(driven), 0.0)
    spectrum[used] *= echo_response(made, v, omega[used], end, dt, integrator)
    detector = EchoDetector(probe, sampling)
    detector.feed(np.fft.irfft(spectrum, period)[:samples])
    return detector.echo(end)


def echo_response(
    specimen: Specimen,
    v: Array,
    omega: Array,
    end: End,
    dt: float = 0.0,
    integrator: Integrator = PEFRL,
) -> Complex:
    """Return the first echo at a free end relative to the end's driven motion.

    Args:
        specimen: The element, unstrained.
        v: Its displacements at rest, shape (N,).
        omega: Angular frequencies, shape (m,), positive; the time factor is exp(i omega t).
        end: The end that is driven, released and listened to.
        dt: Step of the integrator whose numerical damping and dispersion to include; 0 for none.

    Returns:
        Ratio of the complex amplitudes, shape (m,).
    """
    on_site = specimen.alpha * specimen.potential.stiffness(v - specimen.offsets)
    k_r = specimen.k_r
    if end is End.RIGHT:
        on_site, k_r = on_site[::-1], k_r[::-1]
    common = -integrator.squared_frequency(omega, specimen.eta, dt)
    ratio = k_r[-1] / (on_site[-1] + common + k_r[-1])  # v_N / v_{N-1}: the far end is free
    for local, left, right in zip(on_site[-2:0:-1], k_r[-2::-1], k_r[:0:-1], strict=True):
        ratio = left / (local + common + left + right * (1.0 - ratio))
    outgoing = propagation(on_site[0] / k_r[0] + common / k_r[0] + 2.0)
    reflected = (ratio - outgoing) / (1.0 / outgoing - ratio)
    return np.asarray(reflected * (1.0 + outgoing))  # a free end moves farther than the wave


def propagation(trace: Complex) -> Complex:
    """Return the decaying theta of Eq. (4), theta + 1 / theta = trace, |theta| < 1."""
    root = np.sqrt(trace**2 - 4.0)
    first = 0.5 * (trace - root)
    return np.where(np.abs(first) < 1.0, first, 0.5 * (trace + root))
