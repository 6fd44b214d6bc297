# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Echo detection on synthetic signals, against a plain convolution and a plain search.

The carrier filter: each end detects its own pulse, not that of the other end, nothing slower.
"""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mlmem import Settings
from mlmem.instrument.echo import (
    MIN_THRESHOLD_CELLS,
    EchoDetector,
    compute_weights,
    detection_threshold,
    filter_carrier,
)
from mlmem.instrument.end import End
from mlmem.settings import ProbeSettings

from . import rig

DT = 0.25
PROBE = ProbeSettings()
"""omega_c = 2.1, so T = 23.936; sigma = 8, so the pulse ends at 96."""


def times(n):
    return np.arange(1, n + 1) * DT


def convolved(v):
    """Return |v| convolved with a centred box of width 16 pi / 2.1, zero before the start.

    Only where the box has all its samples.
    """
    half = round(8 * np.pi / 2.1 / DT)
    box = np.ones(2 * half + 1) / (2 * half + 1)
    return np.convolve(np.abs(v), box, mode='same')[: len(v) - half]


def heard(v, chunks=(80,)):
    """Feed a signal in chunks of the given sizes, over and over."""
    detector = EchoDetector(PROBE, DT, filtered=False)
    start = 0
    while start < len(v):
        for size in chunks:
            detector.feed_displacements(v[start : start + size])
            start += size
    return detector


@settings(rig.unhurried, max_examples=25)
@given(
    st.lists(st.integers(1, 300), min_size=1, max_size=5),
    st.lists(st.floats(0.0, 600.0), max_size=6),
    st.integers(0, 2**32 - 1),
)
def test_delay_is_first_crossing_for_any_cut_of_samples(chunks, arrivals, seed):
    """Among many echoes and noise; v_c is a centred convolution. It is compared with the threshold
    after the pulse and half a box.
    """
    t, v = times(2600), np.random.default_rng(seed).normal(0.0, 5e-5, 2600)
    for at in arrivals:
        v += 5e-4 * np.exp(-0.5 * ((t - at) / 8.0) ** 2) * np.sin(2.1 * t)
    detector = heard(v, chunks)
    v_c, t = convolved(v), times(len(v) - 48)
    looked = t > 96.0 + 8 * np.pi / 2.1
    ratio = v_c / (1.6e-4 * np.exp(-0.002 * t))
    crossings = t[looked & (ratio > 1.0)]
    assert detector.delay == (crossings[0] if len(crossings) else None)
    assert detector.threshold_margin == pytest.approx(ratio[looked].max(), rel=1e-12)
    echo = detector.build_echo(End.LEFT)
    np.testing.assert_array_equal(echo.t, t)
    np.testing.assert_array_equal(echo.v_m, np.abs(v)[: len(t)])
    # sums of 2600 samples of 5e-5 to 5e-4 are rounded to 1e-16, the means of 97 to less
    np.testing.assert_allclose(echo.v_c, v_c, atol=1e-16)


def test_no_echo_is_detected_while_window_overlaps_pulse():
    """However loud the pulse; a signal right after it is detected at once."""
    v = np.zeros(2000)
    v[times(2000) < 96.0] = 1e6
    detector = heard(v)
    assert detector.delay is None
    assert detector.threshold_margin == 0.0
    assert detector.build_echo(End.LEFT).shape == (None, None, 0.0)
    assert detector.build_echo(End.LEFT).measure_amplitude(math.inf) == 0.0
    v[times(2000) > 96.0] = 1.0
    assert heard(v).delay == 108.0  # the first sample after 96 + T / 2 = 107.968


@pytest.mark.parametrize('gain_decay', [0.02, 1.0])
def test_threshold_never_falls_below_rounding(gain_decay):
    """However fast it decays and however long the detector listens, rounding is no echo."""
    probe = dataclasses.replace(PROBE, gain_decay=gain_decay)
    detector = EchoDetector(probe, 0.25)
    detector.feed_displacements(1e-15 * np.random.default_rng(1).standard_normal(40_000))
    echo = detector.build_echo(End.LEFT)
    assert echo.delay is None
    assert echo.threshold_margin < 1.0
    assert detection_threshold(probe, np.array(1e9)) == MIN_THRESHOLD_CELLS
    assert dataclasses.replace(echo, floor=1e-9).threshold_factor < 1e5


PROBES = {end: end.select_probe(Settings()) for end in End}
"""Case II's carriers: 2.1 at the left, 0.7 at the right."""

STEPS = (0.25, 0.5)
"""Samples of the paper's method and of the fourth-order one."""


def passes(end, dt, omega):
    """Return the amplitude that is left of a wave of amplitude 1, whatever its phase."""
    t = np.arange(6000) * dt
    parts = [
        filter_carrier(wave(omega * t), compute_weights(PROBES[end], dt))
        for wave in (np.sin, np.cos)
    ]
    amplitudes = np.hypot(*parts)
    assert np.ptp(amplitudes) < 1e-9, 'every part of a wave passes alike'
    return amplitudes.mean()


@pytest.mark.parametrize('end', list(End))
@pytest.mark.parametrize('dt', STEPS)
def test_carrier_passes_unchanged_and_in_phase(end, dt):
    """Too few samples give nothing."""
    kernel = compute_weights(PROBES[end], dt)
    for samples, passed in ((0, 0), (3, 0), (len(kernel) - 1, 0), (len(kernel), 1)):
        assert filter_carrier(np.ones(samples), kernel).shape == (passed,)
    n = len(kernel) // 2
    wave = np.sin(PROBES[end].omega_c * np.arange(2000) * dt + 0.4)
    np.testing.assert_allclose(filter_carrier(wave, kernel), wave[n:-n], atol=1e-13)


@pytest.mark.parametrize('end', list(End))
@pytest.mark.parametrize('share', [0.8, 0.9, 1.1, 1.25])
def test_band_is_gaussian_about_carrier(end, share):
    expected = math.exp(-0.5 * (2.0 * math.pi * (share - 1.0)) ** 2)
    got = passes(end, 0.25, share * PROBES[end].omega_c)
    assert got == pytest.approx(expected, abs=2e-3)  # what was subtracted, so that 0 is removed


@pytest.mark.parametrize(
    ('end', 'dt', 'omega', 'most'),
    [
        *((end, dt, 0.0, 1e-13) for end in End for dt in STEPS),  # a strained end stands still
        (End.LEFT, 0.25, 0.7, 2e-4),  # the carrier of the right end
        (End.LEFT, 0.5, 0.7, 2e-4),
        (End.RIGHT, 0.25, 2.1, 2e-5),  # and of the left one
        (End.RIGHT, 0.5, 2.1, 2e-5),
        (End.LEFT, 0.25, 0.47, 2e-4),  # all cells in phase after a strain
        (End.LEFT, 0.25, 0.21, 1e-4),  # a shaken base
        (End.RIGHT, 0.25, 0.07, 1e-4),
    ],
)
def test_waves_far_from_carrier_do_not_pass(end, dt, omega, most):
    """The weights, which end at four standard deviations, let some 1e-4 of any wave pass."""
    assert passes(end, dt, omega) < most
