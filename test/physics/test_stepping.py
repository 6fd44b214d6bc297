# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The step: bounds that hold for every legal element, and runs that are hard but legal."""

import contextlib
import dataclasses
import random

import legal
import numpy as np
import pytest
from sampled import sampled

from mlmem import ELEMENT_NAMES, load_element
from mlmem.physics import (
    CASE_II,
    SUBSTEPS_PER_STEP,
    Chain,
    DesignError,
    HeldCell,
    Scatter,
    Specimen,
    StateError,
    default_step,
    draw_specimen,
    stable_step,
)
from mlmem.physics.energy import energy
from mlmem.physics.pefrl import limit_step
from mlmem.physics.stepping import farthest_reach, highest_frequency


def specimen(chance, design):
    """Return an element of a design with random scatter, wear and faults."""
    scatter = Scatter(alpha=0.3, k_r=0.3, s=0.3, mass=0.2, offset=0.2)
    made = draw_specimen(design, scatter, chance.randrange(2**31))
    return dataclasses.replace(made, eta_factor=chance.choice((0.0, 1.0, 100.0)))


def squared_frequencies(made, configuration):
    """Return the squares of all frequencies of small waves about a configuration."""
    n, design = made.design.N, made.design
    on_site = made.alpha * design.potential.stiffness(configuration - made.offsets)

    def springs(k):
        return np.diag(np.append(k, 0.0) + np.append(0.0, k)) - np.diag(k, 1) - np.diag(k, -1)

    cells = springs(made.k_r) + np.diag(on_site)
    weight = 1.0 / np.sqrt(made.masses)
    if design.substrate == 'rigid':
        return np.linalg.eigvalsh(weight[:, None] * cells * weight)
    both = np.block([
        [cells, -np.diag(on_site)],
        [-np.diag(on_site), springs(made.s) + np.diag(on_site)],
    ])  # fmt: skip
    weight = np.concatenate((weight, [0.0], np.ones(n - 2), [0.0]))  # the ends are moved
    return np.linalg.eigvalsh(weight[:, None] * both * weight)


def test_no_wave_of_any_legal_element_is_faster_than_bound():
    """About any state in the wells of both phases, by exact eigenvalues."""
    for seed in range(80):
        chance = random.Random(seed)
        made = specimen(chance, legal.design(chance))
        low, high = made.design.wells
        share = np.random.default_rng(seed).random(made.design.N)
        bound = highest_frequency(made) ** 2
        for inside in (share, np.round(share)):
            waves = squared_frequencies(made, low + (high - low) * inside + made.offsets)
            assert waves.max() <= bound * (1.0 + 1e-9), (seed, made.design)


def test_step_is_stable_as_far_as_cell_may_get():
    for seed in range(50):
        chance = random.Random(seed)
        made = specimen(chance, legal.design(chance))
        dt = stable_step(made)
        reach = farthest_reach(made, dt)
        assert dt <= limit_step(highest_frequency(made, reach))
        assert reach >= max(abs(edge + made.design.c) for edge in made.design.wells)


def test_steps_of_shipped_elements_are_as_recorded():
    """Bits depend on them. The elastic substrate's is cut to a tick of 20."""
    for name in ELEMENT_NAMES:
        step = default_step(Specimen(load_element(name).design))
        # the stiff cells of 4 levels that bear friction need a shorter one
        expected = 0.4810718 if name == 'robust_2_friction' else 0.5
        assert step == pytest.approx(expected, rel=1e-6), name
    elastic = dataclasses.replace(CASE_II, substrate='elastic')
    assert np.ceil(20.0 / default_step(Specimen(elastic))) == 774


@pytest.mark.parametrize('substrate', ['rigid', 'elastic'])
@pytest.mark.parametrize(('d', 's_min'), [(20.0, 5e3), (1e3, 1e6)])
def test_cell_that_falls_off_its_barrier_creates_no_energy(substrate, d, s_min):
    """However stiff the cells are. At steps stable for small waves only, it did."""
    design = dataclasses.replace(
        CASE_II, N=60, d=d, s_min=s_min, s_max=3.0 * s_min, substrate=substrate
    )
    chain = Chain(design)
    v = np.where(design.sites <= 20, design.D_s2, design.D_s1)
    v[25] = design.D_barrier + 0.01
    chain.place(v)
    begin = energy(chain).total
    for _ in range(25):
        chain.advance_steps(200)
        assert energy(chain).total <= 1.001 * begin


def hard_run(seed):
    """Strain, shake, drive and wear a chain as hard as is legal; return whether it was lost."""
    chance, noise = random.Random(seed), np.random.default_rng(seed)
    chain = Chain(legal.design(chance))
    design, n, steps = chain.design, chain.design.N, 200
    for _ in range(6):
        if chance.random() < 0.3:
            with contextlib.suppress(DesignError):  # it needs a smaller step
                chain.set_specimen(specimen(chance, design))
        share = np.linspace(0.0, 1.0, steps * SUBSTEPS_PER_STEP) ** chance.choice((0.0, 1.0, 3.0))
        goal = design.end_displacement(chance.uniform(-0.5, 0.5))
        V_N = chain.V_N + (goal - chain.V_N) * share
        shake = 0.05 * np.sign(noise.standard_normal(len(V_N)))
        motion = noise.standard_normal((2, chance.randrange(len(V_N))))
        held_cell = HeldCell(chance.choice((1, n)), motion) if chance.random() < 0.3 else None
        before = chain.state(), chain.V_N, chain.steps_done
        try:
            chain.advance(V_N, held_cell, shake)
        except StateError:
            state, *rest = before
            assert chain.state().tobytes() == state.tobytes()
            assert [chain.V_N, chain.steps_done] == rest
            return True
        assert np.isfinite(chain.state()).all()
        assert np.isfinite(energy(chain).total)
    return False


@pytest.mark.parametrize(
    'seeds', sampled([range(80), range(1000, 21_000)], lambda seeds: 0 in seeds)
)
def test_hard_run_leaves_a_finite_state(seeds):
    assert {hard_run(seed) for seed in seeds} == {True, False}
