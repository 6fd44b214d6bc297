# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The moving chains: against SciPy, against themselves, and against misuse.

=======================  ===========================================================
run                      must agree with
=======================  ===========================================================
ramp + driven end        DOP853 on Eqs. (1a), (1b) as printed; the error falls with the order
saved and continued      the run that was not interrupted, to the bit
cut into pieces          the run in one piece, to the bit
driven end               the prescribed motion, to the bit, then free
refused input            the state before, to the bit
=======================  ===========================================================
"""

import dataclasses
import functools
import math
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import oracle
import pytest
from rejection import expect_rejection

from mlmem.physics import (
    CASE_II,
    INTEGRATORS,
    NOH_BATHE,
    PEFRL,
    Chain,
    DesignError,
    HeldCell,
    Specimen,
    StateError,
    stable_step,
    substep_times,
)
from mlmem.physics.equilibrium import find_pinned_wall, wall_profile

SUBSTRATES = pytest.mark.parametrize('substrate', ['rigid', 'elastic'])
METHODS = pytest.mark.parametrize('method', INTEGRATORS.values(), ids=INTEGRATORS)


def case_ii(substrate='rigid', **changes):
    return dataclasses.replace(CASE_II, substrate=substrate, **changes)


# --- against SciPy ----------------------------------------------------------------------------

RAMP, RELEASE, END = 30.0, 20.0, 40.0


def ramp(t):
    """Stretch the element by 1.5 lattice constants."""
    return 1.5 * oracle.smooth(np.asarray(t) / RAMP)


def pulse(t):
    """Return v_1(t), a short burst about s2; it leaves some motion at the release."""
    return CASE_II.D_s2 + 0.05 * np.exp(-0.5 * ((t - 12.0) / 5.0) ** 2) * np.sin(2.1 * t)


def pulse_rate(t):
    return np.imag(pulse(t + 1e-30j)) / 1e-30


def jerked(p):
    """Return a wall that is not in balance: it starts with a jerk."""
    return wall_profile(p, 27.3)


@functools.cache
def by_dop853(p):
    """Return v, v', and V, V' of an elastic substrate, at END; v_1 is driven until RELEASE."""
    rows = oracle.solve(p, oracle.place(jerked(p)), (0.0, RELEASE), ramp, pulse)
    rows[1, 0] = pulse_rate(RELEASE)
    rows = oracle.solve(p, rows, (RELEASE, END), ramp)
    return rows[: 4 if p.substrate == 'elastic' else 2]


def by_chain(p, dt, method):
    """Return the same by the package."""
    steps, driven = round(END / dt), method.substeps * round(RELEASE / dt)
    chain = Chain(p, dt, method)
    chain.place(jerked(p))
    t = substep_times(steps, dt, method)
    chain.advance(ramp(t), HeldCell(1, np.array([pulse(t[:driven]), pulse_rate(t[:driven])])))
    rows = [chain.v, chain.velocity, chain.V, chain.substrate_velocity]
    return np.array(rows[: 4 if p.substrate == 'elastic' else 2])


@pytest.mark.parametrize(
    ('method', 'order', 'cuts', 'substrate', 'N', 'dt', 'errors'),
    [
        # The whole element at the step we use: some (omega dt)^2 / 166 of the pulse.
        (NOH_BATHE, 2, (4, 8), 'rigid', 225, 0.25, (2e-3, 3e-3)),
        # Its frequency is 7e-5 off at 2.1: 4e-3 rad in 28 time units of a pulse of 0.05.
        (PEFRL, 4, (2, 4), 'rigid', 225, 0.5, (2e-4, 4e-4)),
        # A quarter of it: DOP853 must follow the substrate's omega of 17.
        (NOH_BATHE, 2, (4, 8), 'elastic', 60, 0.025, (2e-5, 4e-5, 1e-4)),
        (PEFRL, 4, (2, 4), 'elastic', 60, 0.1, (1e-6, 1e-5, 1e-4)),
    ],
)
def test_element_under_strain_and_pulse_follows_dop853(
    method, order, cuts, substrate, N, dt, errors
):
    """The wall at level 0 is loose, and strong damping shows where it acts."""
    p = case_ii(substrate, N=N, eta=0.05, s_min=25.0, s_max=75.0)
    exact = by_dop853(p)
    coarse, fine, finest = (by_chain(p, dt / k, method) for k in (1, *cuts))
    for row, error in enumerate(errors):
        assert np.abs(coarse - exact)[row].max() < error
    ratio = np.abs(fine - exact)[:2].max() / np.abs(finest - exact)[:2].max()
    gain = 2.0**order
    assert ratio == pytest.approx(gain, rel=0.025)
    extrapolated = (gain * finest - fine) / (gain - 1.0)  # the leading term removed
    np.testing.assert_allclose(extrapolated[:2], exact[:2], atol=2e-6)
    if substrate == 'elastic':  # the substrate rings at omega dt = 0.3 even at the finest step
        np.testing.assert_allclose(extrapolated[2], exact[2], atol=2e-6)
        np.testing.assert_allclose(extrapolated[3], exact[3], atol=1e-4)


def let_go_in_mid_step(substrate, dt):
    """Return the error of a run whose driven end is let go at p dt of a step."""
    p = case_ii(substrate, N=30, eta=0.0)
    steps, driven = round(6.0 / dt), 2 * round(4.0 / dt) + 1
    t = substep_times(steps, dt, NOH_BATHE)[:driven]
    release = t[-1]
    assert release == pytest.approx(4.0 + 0.54 * dt)

    def v_1(t):
        return p.D_s2 + 0.01 * t * t

    start = np.full(p.N, p.D_s2)
    rows = oracle.solve(p, oracle.place(start), (0.0, release), lambda t: 0.0, v_1)
    rows[1, 0] = 0.02 * release
    rows = oracle.solve(p, rows, (release, 6.0), lambda t: 0.0)

    chain = Chain(p, dt, NOH_BATHE)
    chain.place(start)
    chain.advance(np.zeros(2 * steps), HeldCell(1, np.array([v_1(t), 0.02 * t])))
    return np.abs(chain.v - rows[0]).max()


@SUBSTRATES
def test_end_released_in_mid_step_keeps_order(substrate):
    errors = [let_go_in_mid_step(substrate, dt) for dt in (0.02, 0.01)]
    assert errors[0] < 1e-5
    assert errors[1] < errors[0] / 3.0


# --- at rest ----------------------------------------------------------------------------------


@SUBSTRATES
def test_new_chain_is_blank_at_its_default_step(substrate):
    design = case_ii(substrate)
    chain = Chain(design, integrator=NOH_BATHE)
    assert chain.time == 0.0
    assert chain.dt == min(0.25, stable_step(design, NOH_BATHE))
    np.testing.assert_array_equal(chain.configuration, design.D_s1)
    np.testing.assert_array_equal(chain.velocity, 0.0)
    chain.advance_steps(12)
    assert chain.steps_done == 12
    assert chain.time == 12 * chain.dt


@SUBSTRATES
def test_step_out_of_range_is_rejected(substrate):
    limit = stable_step(Specimen(case_ii(substrate)), NOH_BATHE)
    Chain(case_ii(substrate), limit, NOH_BATHE)
    for dt in (0.0, -0.1, 1.001 * limit, math.nan, math.inf):
        with pytest.raises(DesignError, match=rf'^dt must be .* {limit:.5g}.*; got'):
            Chain(case_ii(substrate), dt, NOH_BATHE)


def test_substeps_end_at_p_and_at_one():
    np.testing.assert_allclose(substep_times(3, 0.5, NOH_BATHE), [0.27, 0.5, 0.77, 1.0, 1.27, 1.5])
    assert substep_times(0, 0.5, NOH_BATHE).shape == (0,)


@SUBSTRATES
def test_placed_chain_is_strained_and_accelerates_by_forces(substrate):
    design = case_ii(substrate, N=60)
    chain = Chain(design, integrator=NOH_BATHE)
    v = wall_profile(design, 30.7)
    chain.place(v, V_N=0.8)
    V = 0.8 * oracle.quasi_static(design)
    f, F = oracle.forces(design, v, V)
    np.testing.assert_array_equal(chain.v, v)
    np.testing.assert_allclose(chain.V, V, atol=1e-13)
    np.testing.assert_allclose(chain.configuration, v - V, atol=1e-13)
    assert chain.V_N == 0.8
    state = chain.state()
    np.testing.assert_allclose(state[2], f, atol=1e-12)
    if substrate == 'elastic':
        np.testing.assert_allclose(state[5, 1:-1], F[1:-1], atol=1e-9)  # 3000 times a rounding


# --- to the bit -------------------------------------------------------------------------------


def eventful(design, steps, dt, method):
    """Return a run with everything in it: strain, a driven end, and its release in mid-step."""
    t = substep_times(steps, dt, method)
    V_N = 0.02 * design.N * np.sin(2.0 * np.pi * t / t[-1])
    driven = t[: method.substeps * steps // 3 | 1]
    motion = np.array([design.D_s2 + 0.1 * np.sin(2.1 * driven), 0.21 * np.cos(2.1 * driven)])
    return V_N, motion


def moved(substrate, site=1, pieces=(400,), method=NOH_BATHE):
    """Return a chain after that run, cut into pieces of so many steps, and its recorded ends."""
    design = case_ii(substrate, N=61)
    chain = Chain(design, integrator=method)
    chain.place(find_pinned_wall(design, 1))
    V_N, motion = eventful(design, sum(pieces), chain.dt, method)
    ends, done = [], 0
    for steps in pieces:
        then = done + method.substeps * steps
        rest = motion[:, done:then]
        held_cell = HeldCell(site, rest) if rest.shape[1] else None
        ends.append(chain.advance(V_N[done:then], held_cell))
        done = then
    return chain, np.hstack(ends)


@METHODS
@SUBSTRATES
@pytest.mark.parametrize('site', [1, 61], ids=['left', 'right'])
@pytest.mark.parametrize(
    'pieces',
    [(1,) * 400, (1, 0, 132, 1, 1, 65, 200), (133, 267), (134, 266), (399, 1)],
    ids=lambda pieces: f'{len(pieces)} pieces, first {pieces[0]}',
)
def test_run_cut_into_pieces_is_same_to_bit(substrate, site, pieces, method):
    assert sum(pieces) == 400
    whole, whole_ends = moved(substrate, site, method=method)
    cut, cut_ends = moved(substrate, site, pieces, method)
    np.testing.assert_array_equal(cut.state(), whole.state())
    np.testing.assert_array_equal(cut_ends, whole_ends)
    assert (cut.V_N, cut.steps_done) == (whole.V_N, whole.steps_done)


def test_placed_chain_keeps_accelerations_only_for_noh_bathe():
    """PEFRL has none: a state that held some would not be the one to which a run returns."""
    for method, kept in ((NOH_BATHE, True), (PEFRL, False)):
        chain = Chain(CASE_II, integrator=method)
        chain.place(CASE_II.D_s1 + 0.1 * np.sin(CASE_II.sites))
        assert chain.state()[2].any() == kept


@METHODS
@SUBSTRATES
def test_restored_chain_continues_to_bit(substrate, method):
    chain, _ = moved(substrate, method=method)
    saved, V_N, steps = chain.state(), chain.V_N, chain.steps_done
    later = np.linspace(V_N, 0.0, 300 * method.substeps)
    ends = chain.advance(later)
    goal = chain.state()
    assert np.abs(goal - saved).max() > 1e-3  # it did move on

    for successor in (chain, Chain(chain.design, chain.dt, method)):  # itself, and one anew
        successor.restore(saved, V_N=V_N, steps_done=steps)
        np.testing.assert_array_equal(successor.state(), saved)
        np.testing.assert_array_equal(successor.advance(later), ends)
        np.testing.assert_array_equal(successor.state(), goal)
        assert np.abs(saved - goal).max() > 1e-3, 'a saved state is a copy'
        assert successor.steps_done == steps + 300
        assert successor.V_N == 0.0


@METHODS
@SUBSTRATES
def test_slices_and_whole_numbers_compile_nothing_new(substrate, method):
    """A tick loop must not stop for the compiler because a slice is not contiguous."""
    chain, _ = moved(substrate, method=method)
    loop = method.advance
    known = len(loop.signatures)
    chain.advance(np.zeros(40)[::2])
    chain.advance(np.zeros(20, dtype=int), HeldCell(1, np.zeros((2, 50))[:, ::5]))
    frozen = np.zeros((2, 10))
    frozen.flags.writeable = False
    chain.advance(np.zeros(20), HeldCell(1, frozen))
    assert len(loop.signatures) == known


# --- the driven end ---------------------------------------------------------------------------


@METHODS
@SUBSTRATES
@pytest.mark.parametrize('site', [1, 61], ids=['left', 'right'])
def test_driven_end_follows_its_motion_exactly_and_then_is_free(substrate, site, method):
    design = case_ii(substrate, N=61)
    chain = Chain(design, integrator=method)
    chain.place(find_pinned_wall(design, 1))
    home = chain.end(site)
    t = substep_times(100, chain.dt, method)
    motion = np.array([home + 0.1 * np.sin(0.5 * t), 0.05 * np.cos(0.5 * t)])
    ends = chain.advance(np.zeros(len(t)), HeldCell(site, motion))
    driven, other = (ends[0], ends[1]) if site == 1 else (ends[1], ends[0])
    whole = motion[0, method.substeps - 1 :: method.substeps]
    np.testing.assert_array_equal(driven, whole)
    assert chain.end(site) == motion[0, -1]
    assert chain.velocity[site - 1] == motion[1, -1]
    if substrate == 'rigid':  # within 25 time units the wave has not crossed the chain yet
        early = other[: round(25.0 / chain.dt)]
        assert np.abs(early - other[0]).max() < 1e-5

    free = chain.advance_steps(2)[0 if site == 1 else 1]
    # Let go, it coasts on: at first by its velocity, with a force of at most 0.1 (k + 1).
    coasting = motion[0, -1] + motion[1, -1] * chain.dt * np.array([1.0, 2.0])
    np.testing.assert_allclose(free, coasting, atol=0.5 * 0.2 * (2.0 * chain.dt) ** 2)
    assert np.all(free != motion[0, -1])


# --- refusals ---------------------------------------------------------------------------------


@SUBSTRATES
def test_chain_is_finite_or_lost_but_never_in_between(substrate):
    """A blow-up spreads from row to row of the state; it must be seen in any of them."""
    chain, _ = moved(substrate)
    good, seen = chain.state(), set()
    for row in range(0, len(good), 3):
        for exponent in range(0, 300, 2):
            bad = good.copy()
            bad[row + 1, 30] = 10.0**exponent  # a velocity
            chain.restore(bad, V_N=chain.V_N, steps_done=0)
            try:
                chain.advance_steps(1)
            except StateError:
                seen.add('lost')
            else:
                seen.add('finite')
                assert np.isfinite(chain.state()).all(), (row, exponent)
    assert seen == {'lost', 'finite'}


@METHODS
@SUBSTRATES
@pytest.mark.parametrize(
    ('end', 'loss'),
    [(1e200, 'stopped being finite before step 500'), (80.0, 'stable before step 500')],
)
def test_diverging_run_leaves_chain_as_it_was(substrate, method, end, loss):
    """It then continues as if the run had not been requested."""
    chain, twin = (Chain(case_ii(substrate), integrator=method) for _ in range(2))
    for each in (chain, twin):
        each.advance(np.full(400 * method.substeps, 0.1))
    before = chain.state()
    with pytest.raises(StateError, match=f'{loss}.* as it was at step 400'):
        chain.advance(np.full(100 * method.substeps, end))
    assert chain.state().tobytes() == before.tobytes()
    assert (chain.V_N, chain.steps_done) == (0.1, 400)
    for each in (chain, twin):
        each.advance_steps(100)
    assert chain.state().tobytes() == twin.state().tobytes()


@METHODS
@SUBSTRATES
def test_cell_that_leaves_its_range_and_returns_is_detected(substrate, method):
    """The first cell is pulled out for one step of eight, and put back."""
    design, steps = case_ii(substrate), 8
    still = np.zeros(steps * method.substeps)
    motion = np.stack((np.full_like(still, design.D_s1), still))
    out = slice(3 * method.substeps, 4 * method.substeps)
    chain, other = (Chain(design, integrator=method) for _ in range(2))
    motion[0, out] = chain._range[1] + 1.0
    held_cell = HeldCell(1, motion)
    chain.advance(still, held_cell)  # who looks at the end alone sees nothing
    for ticks in (2, 8):  # after the fourth step and the last, or after every one
        with pytest.raises(StateError, match='left the range'):
            other.advance(still, held_cell, ticks=ticks)
        assert other.state().tobytes() == Chain(design, integrator=method).state().tobytes()


@SUBSTRATES
def test_chains_in_threads_give_bits_of_each_alone(substrate):
    """The loops hold no GIL and share nothing: more chains than threads, each with its shake."""

    def shaken(seed):
        chain = Chain(case_ii(substrate), integrator=NOH_BATHE)
        shake = 0.02 * np.random.default_rng(seed).standard_normal(400)
        chain.advance(np.zeros(400), shake=shake)
        return chain.state().tobytes()

    alone = [shaken(seed) for seed in range(6)]
    assert len(set(alone)) == 6
    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(shaken, range(6))) == alone


WRONG_INPUTS = [
    ('V_N', np.zeros(7), None), ('V_N', np.zeros((2, 4)), None),
    ('V_N', np.array([0.0, math.nan]), None), ('V_N', np.array([math.inf, 0.0]), None),
    ('site', np.zeros(8), HeldCell(0, np.zeros((2, 8)))),
    ('site', np.zeros(8), HeldCell(30, np.zeros((2, 8)))),
    ('motion', np.zeros(8), HeldCell(1, np.zeros(8))),
    ('motion', np.zeros(8), HeldCell(1, np.zeros((3, 8)))),
    ('motion', np.zeros(8), HeldCell(1, np.zeros((2, 9)))),
    ('motion', np.zeros(8), HeldCell(1, np.full((2, 8), math.nan))),
]  # fmt: skip
"""What is wrong, and inputs."""


@SUBSTRATES
def test_wrong_states_and_inputs_are_rejected_and_change_nothing(substrate):
    chain, _ = moved(substrate)
    good, before = chain.state(), (chain.state().tobytes(), chain.V_N, chain.steps_done)
    wrong = [
        lambda: chain.restore(good[:, 1:], V_N=0.0, steps_done=0),
        lambda: chain.restore(np.zeros((9 - len(good), 61)), V_N=0.0, steps_done=0),
        lambda: chain.place(np.zeros(60)),
    ]
    for bad in (math.nan, math.inf, -math.inf):
        for row in range(len(good)):
            state = good.copy()
            state[row, 17] = bad
            wrong.append(functools.partial(chain.restore, state, V_N=0.0, steps_done=0))
        wrong += [
            functools.partial(chain.place, np.append(np.zeros(60), bad)),
            functools.partial(chain.place, np.zeros(61), V_N=bad),
            functools.partial(chain.restore, good, V_N=bad, steps_done=0),
        ]
    for action in wrong:
        with pytest.raises(StateError):
            action()
        assert (chain.state().tobytes(), chain.V_N, chain.steps_done) == before
    for field, V_N, held_cell in WRONG_INPUTS:
        with expect_rejection(StateError, 'out_of_range', field):
            chain.advance(V_N, held_cell)
        assert (chain.state().tobytes(), chain.V_N, chain.steps_done) == before
