# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The transducers: what they hold, when they release it, and what counts as rest."""

import dataclasses
import math

import numpy as np
import pytest

from mlmem import PRESETS, SettingsError
from mlmem.instrument.drivers import Simulation
from mlmem.instrument.end import End, Pulse
from mlmem.instrument.transducer import Transducer, find_upper_edge
from mlmem.physics import CASE_II, INTEGRATORS, Chain, HeldCell
from mlmem.physics.waves import pass_band
from mlmem.settings import ProbeSettings, Settings

from . import rig

XI, CHI = 0.1786178958448091, -0.06626458266981849
STAGES = np.array([XI + CHI, XI, 1.0 - XI, 1.0 - XI - CHI, 1.0])
"""When the stages of a step of the fourth-order method end, in order of time."""


@pytest.mark.parametrize('piece', [1, 7, 80, 192, 1000])
def test_drive_does_not_depend_on_division_of_time(piece):
    """The stages of a step of 0.5 end at five times; the pulse holds all of them up to 96."""
    transducer = rig.device(level=0).transducer
    transducer.fire(End.LEFT)
    pieces = []
    for _ in range(0, 1000, piece):
        held_cell = transducer.held_cell(piece)
        if held_cell is not None:
            assert isinstance(held_cell, HeldCell)
            assert held_cell.site == 1
            pieces.append(held_cell.motion)
    motion = np.concatenate(pieces, axis=1)
    t = 0.5 * np.sort((np.arange(192)[:, None] + STAGES).ravel())
    expected = Pulse(transducer.rest(End.LEFT), transducer.probes[End.LEFT]).at(t)
    assert motion.shape == expected.shape == (2, 960)
    np.testing.assert_allclose(motion, expected, atol=1e-15)  # rounding of the times
    assert not transducer.is_driving


def test_move_may_end_within_step():
    """The first stages after 10.0 end at 10.056 and 10.089: beyond 10.05, and within 10.07."""
    element = rig.device()
    start = element.design.D_s1
    element.transducer.move(End.LEFT, start + 1.005, speed=0.1)
    held_cell = element.transducer.held_cell(40)
    assert held_cell.motion.shape == (2, 100)  # 20 whole steps to 10.0
    assert held_cell.motion[0, -1] == pytest.approx(start + 1.0, abs=1e-14)
    element.transducer.move(End.LEFT, start + 1.007, speed=0.1)
    held_cell = element.transducer.held_cell(40)
    assert held_cell.motion.shape == (2, 101)  # and the first stage of the next, to 10.056
    assert held_cell.motion[0, -1] == pytest.approx(start + 1.0 + 0.05 * STAGES[0], abs=1e-14)


def test_release_frees_cell_at_once_and_stops_listening():
    element = rig.device(level=0)
    assert not element.transducer.is_driving
    element.transducer.fire(End.LEFT)
    element.advance()
    element.transducer.release()
    assert not element.transducer.is_driving
    assert element.transducer.held_cell(80) is None
    assert not element.transducer.detectors
    element.advance()  # nothing is fed to a detector that is gone


def test_detector_filters_displacements_from_first_step():
    """The filter convolves the envelope, 8 wide, with a Gaussian of one period, 3 wide."""
    element = rig.paper(5)
    rest = element.transducer.rest(End.LEFT)
    detector = element.transducer.fire(End.LEFT)
    rig.ticks(element, 8)
    v_m = detector.echo(End.LEFT).v_m
    wide = math.hypot(8.0, 2.0 * math.pi / 2.1)
    t = np.arange(1, 193) * 0.5
    envelope = 0.01 * 8.0 / wide * np.exp(-0.5 * ((t - 48.0) / wide) ** 2)
    pulse = np.abs(envelope * np.sin(2.1 * t))
    np.testing.assert_allclose(v_m[:192], pulse, atol=2e-4)
    assert rest == pytest.approx(element.design.D_s2, abs=1e-3)


def test_both_ends_listen_at_once():
    """Each to its own carrier, since its own pulse. What it knows ends four periods of the filter
    and half a window of eight periods ago, or of four at the right: 29.9 and 53.9 time units.
    """
    element = rig.device(level=3)
    left = element.transducer.fire(End.LEFT)
    rig.ticks(element, 5)
    right = element.transducer.fire(End.RIGHT)
    assert element.transducer.detectors == {End.LEFT: left, End.RIGHT: right}
    rig.ticks(element, 40)
    assert left.time == pytest.approx(900.0 - 8.0 * 2.0 * math.pi / 2.1, abs=1.0)  # two samples
    assert right.time == pytest.approx(800.0 - 6.0 * 2.0 * math.pi / 0.7, abs=1.0)
    element.transducer.release()
    assert not element.transducer.busy


def test_newest_samples_are_kept_and_judged():
    """Eight periods of the slower carrier, 16 pi / 0.7 = 71.8, so 144 steps are kept."""
    transducer = rig.device().transducer
    assert transducer.recent.shape == (2, 144)
    samples = np.random.default_rng(1).normal(size=(2, 700))
    for piece in np.split(samples, [5, 85, 165, 600], axis=1):  # shorter and longer than 144
        transducer.record(piece)
    np.testing.assert_array_equal(transducer.recent, samples[:, -144:])
    for row, end in enumerate(End):
        kept = samples[row, -144:]
        assert transducer.rest(end) == pytest.approx(kept.mean(), abs=1e-15)
        deviation = np.abs(kept - kept.mean()).mean()
        assert transducer.unrest(end) == pytest.approx(deviation, rel=1e-14)


@pytest.mark.parametrize('preset', PRESETS)
def test_upper_edge_is_above_bands_of_both_phases(preset):
    design = PRESETS[preset].design
    tops = [pass_band(k * design.alpha.max())[1] for k in (design.k_s1, design.k_s2)]
    assert max(tops) <= find_upper_edge(design) < max(tops) + 0.1
    if preset not in ('case_1', 'robust_3'):  # all others are of Case II's cells, or as stiff
        assert find_upper_edge(design) == 2.2


@pytest.mark.parametrize('method', INTEGRATORS.values(), ids=INTEGRATORS)
def test_noise_is_distinguished_from_motion_in_stiff_element(method):
    """With Case II's edge its fastest waves would be taken for the sensor's noise."""
    design = dataclasses.replace(CASE_II, N=60, d=2.0, s_min=1e4, s_max=3e4)
    chain = Chain(design, integrator=method)
    probe = ProbeSettings(omega_c=1.0)
    transducer = Transducer(
        chain.design, Settings(probe=probe, probe_right=probe), Simulation(chain)
    )
    t = chain.dt * np.arange(transducer.recent.shape[1])
    wave = 1e-3 * np.sin(pass_band(design.k_s2)[1] * t)
    transducer.record(np.stack((wave, wave)))
    assert transducer.unrest(End.LEFT) > 5e-4
    assert transducer.noise(End.LEFT) < 1e-6


def test_rest_of_too_many_samples_is_rejected():
    chain = Chain(dataclasses.replace(CASE_II, N=60), dt=1e-3)
    probe = ProbeSettings(omega_c=1e-3)
    with pytest.raises(SettingsError, match='omega_c must be at least'):
        Transducer(chain.design, Settings(probe=probe, probe_right=probe), Simulation(chain))
