# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Echoes by linear waves against the chain itself with a small pulse.

The delays of every level at either end are in test_calibration.py.
"""

import numpy as np
import pytest

from mlmem.instrument.end import End
from mlmem.physics import (
    CASE_II,
    Chain,
    HeldCell,
    Scatter,
    Specimen,
    draw_specimen,
    substep_times,
)
from mlmem.physics.equilibrium import find_pinned_wall
from mlmem.physics.pefrl import squared_frequency
from mlmem_tools.checks.echoes import echo_response


def test_no_frequencies_have_no_squares():
    """Those of a pulse whose band lies between two frequencies of the window."""
    assert squared_frequency(np.array([]), 0.004, 0.25).shape == (0,)


def test_right_end_hears_what_the_left_end_of_the_mirror_image_hears():
    made = draw_specimen(CASE_II, Scatter(alpha=0.01, k_r=0.01, offset=0.01), 3)
    mirrored = Specimen(
        CASE_II,
        made.alpha[::-1] / CASE_II.alpha,
        made.k_r[::-1],
        offset=made.offsets[::-1],
    )
    v, omega = find_pinned_wall(made, 1), np.linspace(0.5, 0.75, 11)
    heard = echo_response(made, v, omega, End.RIGHT)
    assert np.abs(heard).max() > 0.1
    assert heard == pytest.approx(echo_response(mirrored, v[::-1], omega, End.LEFT), rel=1e-9)


@pytest.mark.parametrize('k_r', [0.0, 0.003])
def test_chain_returns_what_the_linear_waves_say(k_r):
    """A pulse of 1e-5 cells into Case II with its wall at level 1, all of its echo's waveform.

    The springs' scatter alone changes it by 30 %.
    """
    dt, duration, sigma, carrier = 0.25, 420.0, 8.0, 2.0
    made = draw_specimen(CASE_II, Scatter(k_r=k_r), 3)
    v = find_pinned_wall(made, 1)

    def pulse(t):
        x = (t - 48.0) / sigma
        return 1e-5 * np.exp(-0.5 * x * x) * np.sin(carrier * t)

    chain = Chain(made, dt)
    chain.place(v)
    rest = chain.end(1)
    steps = round(duration / dt)
    times = substep_times(steps, dt)
    held = times[times <= 96.0]
    motion = np.stack((rest + pulse(held), np.gradient(pulse(held), held)))
    heard = chain.advance(np.zeros(len(times)), HeldCell(1, motion))[0] - rest
    period = 4 * steps
    t = np.arange(1.0, period + 1.0) * dt
    omega = 2.0 * np.pi * np.fft.rfftfreq(period, dt)
    used = np.abs(omega - carrier) < 5.0 / sigma
    spectrum = np.where(used, np.fft.rfft(np.where(t <= 96.0, pulse(t), 0.0)), 0.0)
    spectrum[used] *= echo_response(made, v, omega[used], End.LEFT, dt)
    forecast = np.fft.irfft(spectrum, period)[:steps]
    echo = t[:steps] > 170.0
    scale = np.abs(heard[echo]).max()
    # What the forecast leaves out: the ring-down of the end that is let go.
    assert np.abs(heard - forecast)[echo].max() < 0.06 * scale
