# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What may still be on its way to an end, and reads that wait until it is nothing."""

import dataclasses
import math

import numpy as np
import pytest

from mlmem import Read, Settings
from mlmem.instrument.end import End
from mlmem.instrument.transducer import UNLIMITED_SAMPLES, Returns, Reverberation
from mlmem.physics import CASE_II
from mlmem.readers.echo import compute_weights, filter_carrier
from mlmem.readers.listening import has_decayed

from . import rig

DT, TICK = 0.5, 40
"""Samples of Case II: 40 in a tick."""


def follower(end=End.RIGHT, design=CASE_II):
    return Reverberation(design, end.probe(Settings()), DT)


def fed(reverberation, v, past=None, ticks=None):
    """Let an end be seen moving for whole ticks, by default at rest before."""
    past = np.zeros(reverberation.memory) if past is None else past
    reverberation.follow(np.concatenate((past, v)), ticks or len(v) // TICK)


def wave(samples, amplitude=1e-3, omega=0.7):
    return amplitude * np.sin(omega * DT * np.arange(samples))


def test_bound_is_greatest_mean_of_tick_and_fades_as_waves():
    """As exp(-eta t / 2), which is the slowest that a wave can lose."""
    reverberation = follower()
    v = np.concatenate((wave(20 * TICK), np.zeros(60 * TICK)))
    fed(reverberation, v)
    kernel = compute_weights(Settings().probe_right, DT)
    loud = np.abs(filter_carrier(np.concatenate((np.zeros(reverberation.memory), v)), kernel))
    means = loud.reshape(-1, TICK).mean(axis=1)
    fade = math.exp(-0.5 * CASE_II.eta * 20.0)
    expected = max(mean * fade ** (len(means) - 1 - n) for n, mean in enumerate(means))
    assert reverberation.returns.bound == pytest.approx(expected, rel=1e-12)
    before = reverberation.returns.bound
    fed(reverberation, np.zeros(50 * TICK))
    assert reverberation.returns.bound == pytest.approx(before * fade**50, rel=1e-12)
    undamped = follower(design=dataclasses.replace(CASE_II, eta=0.0))
    fed(undamped, wave(20 * TICK))
    before = undamped.returns.bound
    fed(undamped, np.zeros(500 * TICK))
    assert undamped.returns.bound == before
    assert undamped.count_fading_samples(0.5 * before) == UNLIMITED_SAMPLES


def test_it_is_foreseen_when_bound_has_faded():
    reverberation = follower()
    fed(reverberation, wave(20 * TICK))
    limit = 0.1 * reverberation.returns.bound
    samples = reverberation.count_fading_samples(limit)
    assert samples * DT == pytest.approx(math.log(10.0) * 2.0 / CASE_II.eta, abs=DT)
    fed(reverberation, np.zeros(samples // TICK * TICK))
    assert reverberation.returns.bound >= limit
    fed(reverberation, np.zeros(TICK))
    assert reverberation.returns.bound <= limit
    assert reverberation.count_fading_samples(limit) == 0


def test_end_ignores_its_own_drive_but_for_what_returns():
    """Until the filter's memory has passed the motion; waves that return are counted."""
    reverberation = follower()
    pulse = wave(3 * TICK, amplitude=0.01)
    reverberation.ignore(len(pulse))
    assert reverberation.returns == Returns(0.0, 0, len(pulse) + reverberation.memory)
    fed(reverberation, pulse)
    after = math.ceil(reverberation.memory / TICK)
    past = np.concatenate((np.zeros(TICK), pulse))[-reverberation.memory :]
    fed(reverberation, np.zeros(after * TICK), past=past)
    assert reverberation.returns.bound < 1e-12
    assert reverberation.returns.since == (3 + after) * TICK
    fed(reverberation, wave(5 * TICK))
    assert reverberation.returns.bound == pytest.approx(1e-3 * 2.0 / math.pi, rel=0.1)


def test_bound_of_before_drive_is_kept():
    reverberation = follower()
    fed(reverberation, wave(20 * TICK))
    before = reverberation.returns.bound
    reverberation.ignore(3 * TICK)
    assert reverberation.returns.bound == before


@pytest.mark.parametrize('ticks', [1, 7, 50])
def test_bound_has_same_bits_for_any_cut_of_time(ticks):
    v = np.random.default_rng(1).normal(0.0, 1e-4, 100 * TICK + 150)
    runs, single = follower(), follower()
    start = runs.memory
    for each, step in ((runs, ticks), (single, 1)):
        each.ignore(500)
        for first in range(0, 98, step):
            a, b = start + first * TICK, start + min(98, first + step) * TICK
            fed(each, v[a:b], past=v[a - each.memory : a])
    assert runs.returns == single.returns


@pytest.mark.parametrize('level', [0, 3, 7])
def test_waves_stay_below_bound_after_pulses_returned(level):
    """In each tick of the next 6000 time units, against the bound of every tick before.

    Waves of a packet that disperse may meet others again: at level 3 the left end once sees 1.53
    times the bound. The third of the threshold that may be under way leaves a factor of 3.
    """
    element = rig.paper(level)
    rig.succeed(element, Read())
    rig.ticks(element, math.ceil(max(element.passage_time(end) for end in End) / element.tick))
    bounds, heard = [], []
    for _ in range(300):
        element.advance()
        each_end = element.transducer.reverberation
        bounds.append([each_end[end].returns.bound for end in End])
        heard.append([seen(element, end)[-TICK:].mean() for end in End])
    compensated = np.exp(0.5 * CASE_II.eta * element.tick * np.arange(300))[:, None]
    most_to_come = np.maximum.accumulate((np.array(heard) * compensated)[::-1])[::-1]
    assert (most_to_come <= 1.6 * np.array(bounds) * compensated).all()


def seen(element, end):
    """Return the magnitude of the carrier at an end, in the samples that are kept."""
    v = element.transducer.recent[end.row]
    kernel = compute_weights(end.probe(element.settings), DT)
    return np.abs(filter_carrier(np.concatenate((np.full(TICK, v.mean()), v)), kernel))


def test_pulse_is_fired_only_when_last_one_has_decayed():
    """A third of the threshold may be left. At level 0 the left end still expects six times that
    when its echo has been heard, which takes ln(6) 500 = 900 time units to fade.
    """
    element = rig.paper(0)
    rig.succeed(element, Read())
    done = element.ticks
    element.apply(Read())
    while not element.transducer.is_driving:
        element.advance()
    for end, each in element.transducer.reverberation.items():
        probe = element.transducer.probes[end]
        assert each.returns.bound <= element.settings.read.quiet * probe.v_th
    assert (element.ticks - done) * element.tick == pytest.approx(900.0, rel=0.15)
