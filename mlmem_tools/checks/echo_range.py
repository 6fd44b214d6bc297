# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How far an echo carries: damping and dispersion against the farthest level."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from mlmem_ros.device.echo import FAINTEST, falling, threshold, window
from mlmem_ros.device.end import End
from mlmem_ros.device.settings import ProbeSettings
from mlmem_ros.host.design_check import Verdict, worst
from mlmem_ros.physics import Design
from mlmem_ros.physics.potential import Array
from mlmem_ros.physics.waves import band, group_velocity

from .concern import Finding, Subject, judged

FAINT = 1e-7
"""Threshold in cells below which a real sensor would have to be very good."""


def check(subject: Subject) -> Iterator[Finding]:
    """Yield the findings on the range of either end."""
    settings = subject.settings
    for end in End:
        yield _range(subject.design, end.probe(settings), end)


def _range(design: Design, probe: ProbeSettings, end: End) -> Finding:
    """Judge the range that damping and dispersion leave, by closed forms."""
    farthest = max(end.distance(design, level) for level in (0, design.levels - 1))
    distance = np.arange(1.0, 4.0 * design.N)
    t, v_c = echo_strength(design, probe, end.k_s(design), distance)
    audible = v_c > threshold(probe, t)
    reach = float(distance[-1] if audible.all() else distance[audible.argmin()] - 1.0)
    last = float(falling(probe, t[farthest - 1]))
    verdict = worst((judged(reach / farthest, 1.0, 1.0), judged(last, FAINTEST, FAINT)))
    if verdict is Verdict.PASS:
        text = f'the farthest wall, {farthest} cells away, is within the range of the echo'
    elif reach < farthest:
        text = (
            f'damping and dispersion leave a range of {reach:.0f} cells, but the farthest wall is '
            f'{farthest} away: choose less damping, a faster carrier or fewer cells'
        )
    else:
        text = (
            f'the threshold for the farthest echo is {last:.1g} cells, which is demanding for a '
            'sensor: choose less damping or fewer cells'
        )
    return Finding(
        f'range_{end}',
        {'range': reach, 'farthest wall': float(farthest)},
        'cells',
        verdict,
        text,
        'the elapsed time between injection and echo changes with the distance between source '
        'and wall (p. 5); with on-site viscous damping eta (Eq. 1a)',
    )


def echo_strength(
    design: Design, probe: ProbeSettings, k_s: float, distance: Array
) -> tuple[Array, Array]:
    """Return when the echo of a perfect mirror arrives, and how strong it is.

    Every frequency of the pulse travels at its own group velocity and keeps exp(-eta t) of its
    energy over its travel time; the rest of the energy is spread over the arrival times. A free
    end moves twice as far as the wave, and v_c averages |v| over its window.

    Args:
        probe: The pulse.
        k_s: On-site stiffness of the phase it travels in.
        distance: Cells from the end to the mirror, shape (m,).

    Returns:
        Mean delay since the pulse began, and greatest v_c in cells, shape (m,) each; for a pulse
        that does not propagate its own time, and 0.
    """
    omega = probe.omega_c + np.linspace(-3.0, 3.0, 301) / probe.sigma
    density = np.exp(-((probe.sigma * (omega - probe.omega_c)) ** 2))
    low, high = band(k_s)
    travels = (omega > low) & (omega < high)
    if not travels.any():
        return np.full_like(distance, 6.0 * probe.sigma), np.zeros_like(distance)
    time = 2.0 * distance[:, None] / group_velocity(omega[travels], k_s)
    remaining = density[travels] * np.exp(-design.eta * time)
    energy = np.maximum(remaining.sum(axis=1), 1e-300)
    mean = (remaining * time).sum(axis=1) / energy
    spread = (remaining * (time - mean[:, None]) ** 2).sum(axis=1) / energy
    own = 0.5 * probe.sigma**2  # variance of the pulse's energy in time
    length = np.sqrt(own + spread)
    amplitude = 2.0 * probe.A * np.sqrt(energy / density.sum() * math.sqrt(own) / length)
    covered = np.minimum(1.0, math.sqrt(4.0 * math.pi) * length / window(probe))
    return 6.0 * probe.sigma + mean, 2.0 / math.pi * amplitude * covered
