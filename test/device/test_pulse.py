# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Prescribed motions of a boundary cell: as printed in the paper, and as the chain moves."""

import math

import numpy as np
import pytest

from mlmem.instrument.end import End, Move, Pulse
from mlmem.settings import ProbeSettings

from . import rig

ENDS = pytest.mark.parametrize(
    ('end', 'omega_c', 'rest'), [(End.LEFT, 2.1, 1.0029), (End.RIGHT, 0.7, -0.9979)]
)


def printed(t, omega_c, A=0.01, sigma=8.0):
    """Return v - rest as page 5 prints it."""
    return A * np.exp(-0.5 * ((t - 6 * sigma) / sigma) ** 2) * np.sin(omega_c * t)


def derivative(motion, t, h=1e-4):
    """Return dv/dt by central differences, with an error of h^2 / 6 times the third derivative."""
    return (motion.at(t + h)[0] - motion.at(t - h)[0]) / (2 * h)


@pytest.mark.parametrize(
    'probe', [ProbeSettings(), ProbeSettings(omega_c=0.3, sigma=16.0, A=0.05)], ids=['II', 'I']
)
def test_pulse_is_papers(probe):
    pulse = Pulse(0.7, probe)
    t = np.linspace(0.0, 12 * probe.sigma, 4001)
    v, velocity = pulse.at(t)
    expected = printed(t, probe.omega_c, probe.A, probe.sigma)
    np.testing.assert_allclose(v - 0.7, expected, atol=3e-16)
    # A omega^3 h^2 / 6 < 2e-10, and the rounding of v, 1e-16 / h = 1e-12
    np.testing.assert_allclose(velocity, derivative(pulse, t), atol=2e-10)
    assert pulse.duration == 12 * probe.sigma  # 2 t_0, with t_0 = 6 sigma
    faint = probe.A * math.exp(-18.0)  # the envelope six standard deviations out
    assert np.abs(v[[0, -1]] - 0.7).max() <= faint


@pytest.mark.parametrize(('start', 'target'), [(-1.0, 1.0), (1.0, -0.998)])
def test_move_goes_straight_at_its_speed(start, target):
    move = Move(start, target, 0.05)
    assert move.duration == pytest.approx(abs(target - start) / 0.05)
    t = np.linspace(0.0, move.duration, 11)
    v, velocity = move.at(t)
    np.testing.assert_allclose(v, np.linspace(start, target, 11), atol=1e-15)
    np.testing.assert_allclose(velocity, derivative(move, t), atol=1e-11)


@ENDS
def test_pulse_is_enforced_at_end_of_real_chain(end, omega_c, rest):
    """After every step v is the printed one; at every tick's end so is its velocity."""
    element = rig.device(level=3, probe_right=ProbeSettings(omega_c=0.7))
    row, cell = (0, 0) if end == 'left' else (1, -1)
    rest_here = element.transducer.rest(end)
    assert rest_here == pytest.approx(rest, abs=1e-3)
    element.transducer.fire(end)
    pulse = Pulse(rest_here, ProbeSettings(omega_c=omega_c))
    heard = []
    for tick in range(1, 5):  # to 80 of 96 time units
        element.advance()
        heard.append(element.transducer.recent[row, -element.steps_per_tick :])
        velocity = element.chain.velocity[cell]
        assert velocity == pytest.approx(derivative(pulse, np.array([20.0 * tick]))[0], abs=1e-10)
    t = np.arange(1, 4 * element.steps_per_tick + 1) * element.driver.dt
    np.testing.assert_allclose(np.concatenate(heard) - rest_here, printed(t, omega_c), atol=1e-14)
    element.advance()  # the pulse ends within this tick; then the cell rings down freely
    v = element.transducer.recent[row, -element.steps_per_tick :] - rest_here
    t = 80.0 + np.arange(1, element.steps_per_tick + 1) * element.driver.dt
    held = t <= 96.0
    np.testing.assert_allclose(v[held], printed(t, omega_c)[held], atol=1e-14)
    # it would be within 0.01 exp(-18) = 1.5e-10 of rest if it were still held
    assert np.abs(v[~held]).max() > 1e-7
    assert not element.transducer.is_driving


@pytest.mark.parametrize('end', list(End))
def test_cell_is_moved_at_constant_speed_and_let_go(end):
    element = rig.device()
    row, cell = (0, 0) if end == 'left' else (1, -1)
    element.transducer.move(end, 0.0, speed=0.05)
    start = element.design.D_s1
    samples = element.steps_per_tick
    element.advance()  # of -start / 0.05 = 19.96 time units: all steps of a tick but the last
    t = np.arange(1, samples + 1) * element.driver.dt
    v = element.transducer.recent[row, -samples:]
    np.testing.assert_allclose(v[:-1], start + 0.05 * t[:-1], atol=1e-14)
    assert not element.transducer.is_driving
    element.advance()
    later = element.transducer.recent[row, -samples:]
    assert np.abs(later - v[-1]).max() > 1e-3, 'it is still held'
    assert abs(element.chain.velocity[cell]) > 1e-6
