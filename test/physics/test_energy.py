# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Energy, its loss and the step: the terms, the force that is their slope, what a step does to
them, and bounds of the step that hold for every legal element.

=====================  =============================================================
quantity               must agree with
=====================  =============================================================
terms                  those of the Lagrangian as printed above Eq. (1)
forces                 slopes of the energy: on a cell, below it, and on the end
a step                 shrinks the volume of states as the damping does, no more
stability              bounded below omega dt = 2.9895, growing above
frequencies            no wave of a legal element is faster than the bound
dry friction           takes 2 F / k from every half swing
=====================  =============================================================
"""

import contextlib
import dataclasses
import math
import random

import legal
import numpy as np
import oracle
import pytest
from suite import sampled

import mlmem
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
    pefrl,
    stable_step,
)
from mlmem.physics.energy import end_force, energy
from mlmem.physics.equilibrium import compute_energies, metamaterial_force, substrate_force
from mlmem.physics.stepping import farthest_reach, highest_frequency

SUBSTRATES = pytest.mark.parametrize('substrate', ['rigid', 'elastic'])
SMALL = dataclasses.replace(CASE_II, N=60)


def scattered(substrate):
    """Return an element whose cells and springs differ."""
    depth = 0.2 if substrate == 'rigid' else 0.0
    scatter = Scatter(alpha=0.1, k_r=0.1, s=0.1, mass=0.1, offset=0.05, depth=depth)
    return draw_specimen(dataclasses.replace(SMALL, substrate=substrate), scatter, 1)


def rough():
    """Return displacements v with a wall and everything out of balance."""
    random = np.random.default_rng(0)
    return np.where(SMALL.sites < 30, SMALL.D_s2, SMALL.D_s1) + 0.3 * random.standard_normal(60)


@SUBSTRATES
def test_forces_are_slopes_of_energy(substrate):
    """Moving V_N moves the whole foundation of the rigid model, one site of the elastic one."""
    made = scattered(substrate)
    chain, h = Chain(made), 1e-5
    chain.place(rough(), V_N=0.7)
    v, V = chain.v, 0.7 * oracle.quasi_static(SMALL, made.s_factor)
    cell, end = np.eye(SMALL.N)[[9, -1]]

    def slope(by_v, by_V):
        up, down = (sum(compute_energies(made, v + k * by_v, V + k * by_V)) for k in (h, -h))
        return pytest.approx((up - down) / (2.0 * h), abs=1e-6)

    moved = made.strain_shape if substrate == 'rigid' else end
    assert end_force(chain, v, chain.V) == slope(0.0, moved)
    assert -metamaterial_force(made, v, V)[9] == slope(cell, 0.0)
    assert -substrate_force(made, v, V)[9] == slope(0.0, cell)


@SUBSTRATES
def test_energy_is_the_sum_of_the_printed_terms(substrate):
    made = scattered(substrate)
    chain = Chain(made)
    chain.place(rough(), V_N=0.4)
    chain.advance(0.4 + 0.01 * np.arange(40))
    parts = energy(chain)
    moving = np.sum(made.masses * chain.velocity**2) + np.sum(chain.substrate_velocity**2)
    assert parts.kinetic == pytest.approx(0.5 * moving, rel=1e-14)
    D = chain.configuration - made.offsets
    wells = oracle.alpha(SMALL) * made.alpha_factor * oracle.psi(SMALL, D)
    wells -= made.depth_force * (D - SMALL.D_s1)
    assert parts.on_site == pytest.approx(np.sum(wells), rel=1e-12)
    stretched = made.k_r_factor * np.diff(chain.v) ** 2
    assert parts.coupling == pytest.approx(0.5 * np.sum(stretched), rel=1e-14)
    below = oracle.s(SMALL) * made.s_factor * np.diff(chain.V) ** 2
    assert parts.substrate == pytest.approx(0.5 * np.sum(below), rel=1e-12)
    statics = parts.coupling + parts.on_site + parts.substrate
    assert parts.total == pytest.approx(parts.kinetic + statics, rel=1e-15)
    assert parts.kinetic > 0.0


@pytest.mark.parametrize('eta', [0.0, 1 / 250, 0.3, 5.0])
def test_step_shrinks_volume_of_states_by_damping_alone(eta):
    """Liouville: det = exp(-eta dt), whatever the stiffness and the step."""
    for dt in (0.1, 0.5, 1.2):
        matrix = pefrl.step_matrix(np.array([0.1, 1.0, 4.5], dtype=complex), eta, dt)
        np.testing.assert_allclose(np.linalg.det(matrix), math.exp(-eta * dt), rtol=1e-13)


def test_step_is_stable_up_to_published_limit():
    """It is 2.9895: below, the factors of a step are of size 1; above, waves grow."""
    for phase, largest in ((pefrl.MAX_STABLE_PHASE, 1.0), (3.0, 1.067)):
        step = pefrl.step_matrix(np.array([phase**2], dtype=complex), 0.0, 1.0)
        assert np.abs(np.linalg.eigvals(step)).max() == pytest.approx(largest, abs=1e-3)


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


@SUBSTRATES
@pytest.mark.parametrize('eta', [0.0, 1 / 250, 1.0, 10.0])
def test_stable_step_is_stable_and_not_too_small(substrate, eta):
    """A rough start stays small at the largest step allowed."""
    design = dataclasses.replace(SMALL, substrate=substrate, eta=eta)
    chain = Chain(design, stable_step(design))
    chain.place(design.D_s1 + 1e-3 * np.random.default_rng(1).standard_normal(design.N))
    chain.advance_steps(4000)
    assert np.abs(chain.v - design.D_s1).max() < 5e-3
    fastest = 2.0 * math.sqrt(design.s.max()) if substrate == 'elastic' else 2.14
    assert 0.9 < chain.dt * fastest / pefrl.MAX_STABLE_PHASE <= 0.951


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
    """About any state in the wells of both phases, by exact eigenvalues; and its step is stable as
    far as a cell may get.
    """
    for seed in range(80):
        chance = random.Random(seed)
        made = specimen(chance, legal.design(chance))
        low, high = made.design.wells
        share = np.random.default_rng(seed).random(made.design.N)
        bound, dt = highest_frequency(made) ** 2, stable_step(made)
        for inside in (share, np.round(share)):
            waves = squared_frequencies(made, low + (high - low) * inside + made.offsets)
            assert waves.max() <= bound * (1.0 + 1e-9), (seed, made.design)
        reach = farthest_reach(made, dt)
        assert dt <= pefrl.limit_step(highest_frequency(made, reach))
        assert reach >= max(abs(edge + made.design.c) for edge in made.design.wells)


def test_steps_of_shipped_elements_are_as_recorded():
    """Bits depend on them. The elastic substrate's is cut to a tick of 20."""
    for name in mlmem.ELEMENT_NAMES:
        step = default_step(Specimen(mlmem.load_element(name).design))
        # the stiff cells of 4 levels that bear friction need a shorter one
        expected = 0.4810718 if name == 'robust_2_friction' else 0.5
        assert step == pytest.approx(expected, rel=1e-6), name
    elastic = dataclasses.replace(CASE_II, substrate='elastic')
    assert np.ceil(20.0 / default_step(Specimen(elastic))) == 774


@SUBSTRATES
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
