# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The robust elements are written and erased by kicks although all their cells scatter."""

import dataclasses
import math

import numpy as np
import pytest

import mlmem
from mlmem.instrument.end import Kick
from mlmem.physics import (
    CASE_II,
    INTEGRATORS,
    Chain,
    HeldCell,
    Scatter,
    default_step,
    find_walls,
    scattered,
    substep_times,
)

SCATTER = Scatter(alpha=0.03, k_r=0.03, mass=0.03)


def kick(chain, target, speed, shape):
    """Kick the left end to a ground state, and wait until the wall rests."""
    motion = Kick(chain.end(1), target, speed, shape)
    times = substep_times(math.ceil(motion.duration / chain.dt), chain.dt, chain.integrator)
    chain.advance(np.zeros(len(times)), HeldCell(1, motion.at(times)))
    chain.rest(math.ceil(shape.settle / chain.dt))


@pytest.mark.parametrize('name', ['robust_2', 'robust_3'])
@pytest.mark.parametrize('seed', [1, 2])
def test_scattered_element_writes_and_erases_every_level(name, seed):
    element = mlmem.load_element(name)
    design, shape = element.design, element.settings.kick
    method = INTEGRATORS['pefrl']
    specimen = scattered(design, SCATTER, seed)
    for level, speed in enumerate(shape.wall_speeds):
        chain = Chain(design, 0.9 * default_step(design, method), method)
        chain.set_specimen(specimen)
        kick(chain, design.D_s2, speed, shape)
        (wall,) = find_walls(design, chain.configuration)
        arrived = min(1.5, design.J / 4.0)
        assert wall.position == pytest.approx(design.defect_site(level), abs=arrived)
        kick(chain, design.D_s1, shape.erase_speed, shape)
        assert not find_walls(design, chain.configuration)


def test_friction_takes_the_same_amplitude_from_every_swing():
    """All cells swing alike about s1: each half period takes 2 F / k, exactly for a linear
    force.
    """
    friction, amplitude = 2e-5, 1e-2
    design = dataclasses.replace(CASE_II, N=30, gamma=0.0, beta=0.0, eta=0.0, friction=friction)
    half_period = math.pi / math.sqrt(design.k_s1)
    run = mlmem.simulate(
        design,
        initial=np.full(design.N, design.D_s1 + amplitude),
        duration=4.0 * half_period,
        save_every=half_period / 100.0,
        progress=False,
    )
    swings = run.configuration[::100, 15] - design.D_s1
    loss = 2.0 * friction / design.k_s1
    expected = [(-1) ** n * (amplitude - n * loss) for n in range(5)]
    # 5 %: the force is linear up to 2 % at this amplitude, and friction viscous near rest.
    assert np.abs(swings - expected).max() < 0.05 * 4.0 * loss
