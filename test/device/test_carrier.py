# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The carrier filter: each end hears its own pulse, not that of the other end, nothing slower."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mlmem import Settings
from mlmem.instrument.end import End
from mlmem.readers.echo import EchoDetector, compute_weights, filter_carrier

from . import rig

PROBES = {end: end.probe(Settings()) for end in End}
"""Case II's carriers: 2.1 at the left, 0.7 at the right."""

STEPS = (0.25, 0.5)
"""Samples of the paper's method and of the fourth-order one."""

AT_ENDS = pytest.mark.parametrize('end', list(End))
SAMPLED = pytest.mark.parametrize('dt', STEPS)


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


@AT_ENDS
@SAMPLED
def test_carrier_passes_unchanged_and_in_phase(end, dt):
    kernel = compute_weights(PROBES[end], dt)
    n = len(kernel) // 2
    wave = np.sin(PROBES[end].omega_c * np.arange(2000) * dt + 0.4)
    np.testing.assert_allclose(filter_carrier(wave, kernel), wave[n:-n], atol=1e-13)


@AT_ENDS
@SAMPLED
def test_constant_does_not_pass(end, dt):
    """Nor the displacement of a strained end, of hundreds of cells."""
    kernel = compute_weights(PROBES[end], dt)
    assert abs(kernel.sum()) < 1e-15
    np.testing.assert_allclose(filter_carrier(np.full(2000, 500.0), kernel), 0.0, atol=1e-13)


@AT_ENDS
@pytest.mark.parametrize('share', [0.8, 0.9, 1.1, 1.25])
def test_band_is_gaussian_about_carrier(end, share):
    expected = math.exp(-0.5 * (2.0 * math.pi * (share - 1.0)) ** 2)
    got = passes(end, 0.25, share * PROBES[end].omega_c)
    assert got == pytest.approx(expected, abs=2e-3)  # what was subtracted, so that 0 is removed


@pytest.mark.parametrize(
    ('end', 'dt', 'omega', 'most'),
    [
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


@AT_ENDS
def test_two_pulses_at_once_are_reported_apart(end):
    """An echo is found as if alone beside a pulse of the other carrier, ten times as loud."""
    dt, t = 0.5, np.arange(4000) * 0.5
    own, other = PROBES[end], PROBES[end.opposite]

    def packet(probe, at, amplitude):
        wave = np.sin(probe.omega_c * (t - at))
        return amplitude * np.exp(-0.5 * ((t - at) / 12.0) ** 2) * wave

    echo = packet(own, 700.0, 20.0 * own.v_th)
    alone, beside = (EchoDetector(own, dt) for _ in range(2))
    alone.feed(echo)
    beside.feed(echo + packet(other, 350.0, 200.0 * own.v_th))
    assert alone.delay is not None
    assert beside.delay == pytest.approx(alone.delay, abs=dt)


def test_too_few_samples_give_nothing():
    kernel = compute_weights(PROBES[End.LEFT], 0.5)
    for n in (0, 3, len(kernel) - 1):
        assert filter_carrier(np.ones(n), kernel).shape == (0,)
    assert filter_carrier(np.ones(len(kernel)), kernel).shape == (1,)


@settings(rig.unhurried, max_examples=25)
@given(st.lists(st.integers(0, 4000), max_size=5))
def test_detector_has_same_bits_for_any_cut_of_samples(cuts):
    """What was there before the pulse belongs to the first samples that the filter passes."""
    past, v = np.split(np.random.default_rng(1).normal(0.0, 1e-4, 4150), [150])
    at_once, cut = (EchoDetector(PROBES[End.LEFT], 0.5, past=past) for _ in range(2))
    at_once.feed(v)
    for some in np.split(v, sorted(cuts)):
        cut.feed(some)
    first, second = at_once.echo(End.LEFT), cut.echo(End.LEFT)
    assert len(first.t) > 3900
    assert first.delay == second.delay
    assert first.v_m.tobytes() == second.v_m.tobytes()
    assert first.v_c.tobytes() == second.v_c.tobytes()
    kernel = compute_weights(PROBES[End.LEFT], 0.5)
    known = np.concatenate((past[-(len(kernel) // 2) :], v))
    np.testing.assert_array_equal(
        first.v_m, np.abs(filter_carrier(known, kernel))[: len(first.v_m)]
    )
