# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Dry friction against a closed form."""

import dataclasses
import math

import numpy as np

import mlmem
from mlmem.physics import (
    CASE_II,
)


def test_friction_takes_same_amplitude_from_every_swing():
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
