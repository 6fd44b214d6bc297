# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A specimen: scatter, stuck cells and a shaken base, against DOP853 and closed forms; and the
streams of random numbers from which it is drawn: a seed gives the same numbers as ever.
"""

import dataclasses
import itertools
import math

import numpy as np
import oracle
import pytest
from suite import expect_rejection

from mlmem.element_file import load_element
from mlmem.parameter_sweep import sweep
from mlmem.parsing import decode_value, encode_value
from mlmem.physics import (
    CASE_II,
    Chain,
    DesignError,
    Scatter,
    Specimen,
    StateError,
    draw_specimen,
    find_level,
    find_walls,
    substep_times,
    wall_energy,
)
from mlmem.physics.energy import end_force, kinetic_energy
from mlmem.physics.equilibrium import (
    compute_energies,
    find_pinned_wall,
    make_blank,
    metamaterial_force,
    relax_to_equilibrium,
    stiffness_diagonal,
    substrate_force,
    wall_profile,
)
from mlmem.physics.held_wall import hold_walls
from mlmem.physics.waves import linearize_cells
from mlmem.rng import RandomStream, draw_normal, make_generator
from mlmem.simulation import simulate

SMALL = dataclasses.replace(CASE_II, N=51)
SCATTER = Scatter(alpha=0.1, k_r=0.1, s=0.1, mass=0.1, offset=0.05, depth=0.2)


STATE = CASE_II.D_s1 + 0.3 * np.sin(CASE_II.sites), 0.5 * CASE_II.strain_shape


@pytest.mark.parametrize(
    'call',
    [
        lambda material: metamaterial_force(material, *STATE),
        lambda material: substrate_force(material, *STATE),
        lambda material: stiffness_diagonal(material, *STATE),
        lambda material: compute_energies(material, *STATE),
        lambda material: make_blank(material),
        lambda material: find_pinned_wall(material, 3),
        lambda material: linearize_cells(material, STATE[0]),
        lambda material: kinetic_energy(material, *STATE),
        lambda material: end_force(material, *STATE),
        lambda material: hold_walls(material, np.array([80.0]), np.zeros(CASE_II.N)).energy,
        lambda material: wall_energy(material),
        lambda material: wall_profile(material, 80.0),
        lambda material: find_level(material, wall_profile(CASE_II, 80.0)),
        lambda material: find_walls(material, wall_profile(CASE_II, 80.0))[0].position,
        lambda material: Chain(material).advance(np.linspace(0.0, 1.0, 20)),
        lambda material: simulate(material, duration=2.0, strain=0.01).displacement,
        lambda material: sweep(material, measure=lambda made: made.eta, eta=[0.01])['value'],
        lambda material: draw_specimen(material, SCATTER, 1).alpha,
    ],
    ids=lambda call: call.__code__.co_names[0],
)
def test_function_of_material_takes_design_specimen_and_element(call):
    expected = call(CASE_II)
    for material in (Specimen(CASE_II), load_element('case_2'), Chain(CASE_II)):
        np.testing.assert_array_equal(call(material), expected)
    with expect_rejection(DesignError, 'out_of_range', 'material'):
        call('case_2')


def test_ideal_specimen_gives_bits_of_design():
    plain, made = Chain(CASE_II), Chain(CASE_II)
    made.set_specimen(Specimen(CASE_II))
    made.set_specimen(draw_specimen(CASE_II, Scatter(), seed=3))
    strain = np.linspace(0.0, 2.0, 400)
    plain.advance(strain)
    made.advance(strain, shake=np.zeros(400))
    assert plain.state().tobytes() == made.state().tobytes()


def strain(t):
    return 1.5 * np.sin(0.05 * t)


def shake(t):
    """Return the acceleration of the base."""
    return 0.02 * np.sin(0.4 * t)


SHORT = dataclasses.replace(SMALL, N=27, s_min=20.0, s_max=26.0)
"""Its substrate is so soft that DOP853 need not follow fast waves."""

SOFT = dataclasses.replace(SHORT, substrate='elastic')


# 1e-5 at 0.1, and a sixteenth of it at half the step. Over an elastic substrate damping leaves
# 6e-6 beside a stuck cell, half of it at half the step: it damps either mass before they are
# joined.
@pytest.mark.parametrize(
    ('design', 'scatter', 'changes', 'errors'),
    [
        (SMALL, SCATTER, {'eta_factor': 3.0}, {0.1: 1.5e-5, 0.05: 1e-6}),
        (SOFT, Scatter(k_r=0.2), {}, {0.05: 5e-6}),
        (SHORT, Scatter(k_r=0.05, mass=0.1), {'stuck': (9, 17)}, {0.05: 1e-5}),
        (SOFT, Scatter(k_r=0.05, mass=0.1), {'stuck': (9, 17)}, {0.05: 1e-5}),
    ],
    ids=['scattered', 'springs over an elastic substrate', 'stuck', 'stuck over an elastic one'],
)
def test_specimen_moves_as_dop853_says(design, scatter, changes, errors):
    """From a wall that is not in balance."""
    made = dataclasses.replace(draw_specimen(design, scatter, seed=4), **changes)
    sites, end = design.sites, 12.0
    wall = np.where(sites < 0.4 * design.N, design.D_s2, design.D_s1) + 0.05 * np.sin(sites)
    exact = oracle.solve(made, oracle.place(wall), (0.0, end), strain, shake=shake)[0]
    for dt, error in errors.items():
        t = substep_times(round(end / dt), dt)
        chain = Chain(made, dt)
        chain.place(wall)
        chain.advance(strain(t), shake=shake(t))
        np.testing.assert_allclose(chain.v, exact, atol=error)


def test_specimen_comes_back_from_plain_values():
    made = draw_specimen(SMALL, SCATTER, seed=2)
    again = decode_value(Specimen, encode_value(made))
    for name in ('alpha', 'k_r', 's', 'masses', 'offsets', 'depths'):
        assert (getattr(again, name) == getattr(made, name)).all()
    assert Specimen(SMALL, k_r_factor=1.0).springs == ()  # the loops are compiled without them
    assert Specimen(SMALL, k_r_factor=1.001).springs != ()


def test_equilibrium_keeps_its_stuck_cell():
    """The wall rests beside it as it does in a free chain, if the cell sticks where it rests."""
    v = find_pinned_wall(CASE_II, 3)
    made = Specimen(CASE_II, stuck=(90,))
    np.testing.assert_allclose(relax_to_equilibrium(made, v, np.zeros(CASE_II.N)), v, atol=1e-10)
    pushed = v.copy()
    pushed[89] += 0.05
    held = relax_to_equilibrium(made, pushed, np.zeros(CASE_II.N))
    assert held[89] == pushed[89]
    force = metamaterial_force(made, held, np.zeros(CASE_II.N))
    assert np.abs(np.delete(force, 89)).max() < 1e-10 < 1e-3 < abs(force[89])


def test_scatter_has_given_deviation_and_depends_on_seed():
    design = dataclasses.replace(CASE_II, N=20_000, gamma=0.0)
    scatter = Scatter(alpha=0.1, k_r=0.08, s=0.12, mass=0.09, offset=0.05, depth=0.2)
    made = draw_specimen(design, scatter, seed=5)
    for values, deviation in (
        (made.alpha_factor, scatter.alpha), (made.k_r_factor, scatter.k_r),
        (made.s_factor, scatter.s), (made.masses, scatter.mass),
        (made.offsets, scatter.offset), (made.depths, scatter.depth),
    ):  # fmt: skip
        # the standard error of a deviation is its 1 / sqrt(2 n): four of them
        assert np.std(values) == pytest.approx(deviation, rel=4 / math.sqrt(40_000))
    again = draw_specimen(design, dataclasses.replace(scatter, mass=0.0), seed=5)
    np.testing.assert_array_equal(made.alpha_factor, again.alpha_factor)
    assert (again.masses == 1.0).all()
    assert (draw_specimen(design, scatter, seed=6).masses != made.masses).all()


@pytest.mark.parametrize(
    ('field', 'value'),
    [
        ('alpha_factor', np.ones(3)), ('alpha_factor', 0.0), ('s_factor', np.nan),
        ('k_r_factor', np.ones(51)), ('k_r_factor', 0.0), ('mass', -1.0), ('mass', np.inf),
        ('stuck', (1,)), ('stuck', (51,)), ('offset', 0.6), ('offset', np.nan), ('depth', 0.6),
        ('eta_factor', -1.0), ('eta_factor', math.nan),
        ('design', None), ('design', Specimen(SMALL)), ('design', 'case_2'),
    ],
)  # fmt: skip
def test_specimen_values_out_of_range_are_rejected(field, value):
    with expect_rejection(DesignError, 'out_of_range', field):
        Specimen(**{'design': SMALL, field: value})


@pytest.mark.parametrize('deviation', [-0.01, math.nan])
def test_scatter_below_zero_is_rejected(deviation):
    with expect_rejection(DesignError, 'out_of_range', 'mass'):
        Scatter(mass=deviation)


@pytest.mark.parametrize('name', ['mass', 'offset', 'depth'])
def test_first_wrong_cell_is_named_with_its_value(name):
    values = np.full(SMALL.N, 0.1)
    values[[4, 9]] = -3.0 if name == 'mass' else 0.7
    with expect_rejection(DesignError, 'out_of_range', name) as caught:
        Specimen(SMALL, **{name: values})
    assert caught.value.value == values[4]
    assert '(at 5)' in caught.value.expected


def test_depth_is_energy_between_wells_over_barrier():
    """The wells themselves shift by the force over their stiffness, which changes little more."""
    made = Specimen(SMALL, alpha_factor=1.0 / SMALL.alpha, depth=0.1)
    blank, full = (
        relax_to_equilibrium(made, np.full(SMALL.N, D), np.zeros(SMALL.N))
        for D in (SMALL.D_s1, SMALL.D_s2)
    )
    one, other = (sum(compute_energies(made, v, np.zeros(SMALL.N))) for v in (blank, full))
    assert one - other == pytest.approx(SMALL.N * 0.1 * 2.0 * SMALL.d, rel=0.02)
    with pytest.raises(DesignError, match='0 over an elastic substrate'):
        dataclasses.replace(made, design=dataclasses.replace(SMALL, substrate='elastic'))


@pytest.mark.parametrize(
    ('field', 'value'),
    [
        ('alpha_factor', 1.01), ('k_r_factor', 1.01), ('s_factor', 1.01), ('mass', 1.01),
        ('offset', 0.01), ('depth', 0.01), ('eta_factor', 1.01), ('stuck', (9,)),
    ],
)  # fmt: skip
def test_specimen_is_ideal_until_a_field_deviates(field, value):
    assert draw_specimen(SMALL, Scatter(), seed=1).is_ideal
    assert not Specimen(SMALL, **{field: value}).is_ideal


def test_only_rigid_substrate_can_damp_cells():
    made = Specimen(SMALL, damped_by_substrate=True)
    assert not made.is_ideal
    assert decode_value(Specimen, encode_value(made)).damped_by_substrate
    with pytest.raises(DesignError, match=r'^damped_by_substrate must be false'):
        dataclasses.replace(made, design=dataclasses.replace(SMALL, substrate='elastic'))


def test_chain_rejects_specimen_and_shake_it_cannot_run():
    chain = Chain(SMALL)
    with pytest.raises(DesignError, match='design'):
        chain.set_specimen(Specimen(CASE_II))
    with pytest.raises(DesignError, match=r'^dt must be'):
        chain.set_specimen(Specimen(SMALL, mass=0.001))
    before = chain.state()
    for shake in (np.full(5, np.nan), np.zeros(3)):
        with pytest.raises(StateError, match='shake'):
            chain.advance(np.zeros(5), shake=shake)
    assert chain.state().tobytes() == before.tobytes()


SPAWNED = [
    RandomStream[name] for name in ('ALPHA', 'S', 'MASS', 'OFFSET', 'SCREEN', 'LEVELS', 'GAIN')
]


def test_streams_are_spawned_from_the_seed_in_order():
    children = np.random.SeedSequence(7).spawn(len(SPAWNED))
    for stream, child in zip(SPAWNED, children, strict=True):
        expected = np.random.Generator(np.random.PCG64(child)).random(5)
        assert make_generator(7, stream).random(5).tolist() == expected.tolist()


def test_no_two_streams_are_alike():
    ticks = [draw_normal((50,), 1, 2, stream) for stream in RandomStream if stream not in SPAWNED]
    made = [make_generator(1, stream).standard_normal(50) for stream in SPAWNED]
    for one, other in itertools.combinations([*ticks, *made], 2):
        assert not set(one) & set(other)
        assert abs(np.corrcoef(one, other)[0, 1]) < 0.5
