# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The chains, moving and at rest: against SciPy, against themselves, and against misuse.

=======================  ===========================================================
run                      must agree with
=======================  ===========================================================
ramp + driven end        DOP853 on Eqs. (1a), (1b) as printed; the error falls with the order
cut into pieces          the run in one piece, to the bit
rest                     the run that never rests; it ends for whatever moves a cell
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
from suite import expect_rejection

from mlmem.physics import (
    CASE_II,
    SUBSTEPS_PER_STEP,
    Chain,
    DesignError,
    HeldCell,
    Specimen,
    StateError,
    pefrl,
    stable_step,
    substep_times,
)
from mlmem.physics.cells import MAX_REST_SPEED
from mlmem.physics.equilibrium import find_pinned_wall, wall_profile

SUBSTRATES = pytest.mark.parametrize('substrate', ['rigid', 'elastic'])


def case_ii(substrate='rigid', **changes):
    return dataclasses.replace(CASE_II, substrate=substrate, **changes)


# --- against SciPy ----------------------------------------------------------------------------

RAMP, RELEASE, END = 18.0, 12.0, 20.0


def ramp(t):
    """Stretch the element by 1.5 lattice constants, with two continuous derivatives."""
    x = np.clip(t / RAMP, 0.0, 1.0)
    return 1.5 * x**3 * (10.0 - 15.0 * x + 6.0 * x * x)


def pulse(t):
    """Return v_1(t), a short burst about s2; it leaves some motion at the release."""
    return CASE_II.D_s2 + 0.05 * np.exp(-0.5 * ((t - 8.0) / 4.0) ** 2) * np.sin(2.1 * t)


def pulse_rate(t):
    return np.imag(pulse(t + 1e-30j)) / 1e-30


def by_chain(p, start, dt):
    """Return v, v', and V, V' of an elastic substrate, at END; v_1 is driven until RELEASE."""
    steps, driven = round(END / dt), SUBSTEPS_PER_STEP * round(RELEASE / dt)
    chain = Chain(p, dt)
    chain.place(start)
    t = substep_times(steps, dt)
    chain.advance(ramp(t), HeldCell(1, np.array([pulse(t[:driven]), pulse_rate(t[:driven])])))
    rows = [chain.v, chain.velocity, chain.V, chain.substrate_velocity]
    return np.array(rows[: 4 if p.substrate == 'elastic' else 2])


@pytest.mark.parametrize(
    ('substrate', 'N', 'dt', 'errors'),
    [
        # The whole element at the step we use: its frequency is 7e-5 off at 2.1, which makes
        # 4e-3 rad in 28 time units of a pulse of 0.05.
        ('rigid', 225, 0.5, (2e-4, 4e-4)),
        # A quarter of it: DOP853 must follow the substrate's omega of 17.
        ('elastic', 60, 0.1, (1e-6, 1e-5, 1e-4)),
    ],
)
def test_element_under_strain_and_pulse_follows_dop853(substrate, N, dt, errors):
    """The wall at level 0 is loose, and strong damping shows where it acts."""
    p = case_ii(substrate, N=N, eta=0.05, s_min=25.0, s_max=75.0)
    start = wall_profile(p, 27.3)  # not in balance: it starts with a jerk
    rows = oracle.solve(p, oracle.place(start), (0.0, RELEASE), ramp, pulse)
    rows[1, 0] = pulse_rate(RELEASE)
    exact = oracle.solve(p, rows, (RELEASE, END), ramp)[: 4 if substrate == 'elastic' else 2]
    coarse, fine, finest = (by_chain(p, start, dt / k) for k in (1, 2, 4))
    for row, error in enumerate(errors):
        assert np.abs(coarse - exact)[row].max() < error
    ratio = np.abs(fine - exact)[:2].max() / np.abs(finest - exact)[:2].max()
    gain = 2.0**4
    assert ratio == pytest.approx(gain, rel=0.025)
    extrapolated = (gain * finest - fine) / (gain - 1.0)  # the leading term removed
    np.testing.assert_allclose(extrapolated[:2], exact[:2], atol=2e-6)
    if substrate == 'elastic':  # the substrate rings at omega dt = 0.3 even at the finest step
        np.testing.assert_allclose(extrapolated[2], exact[2], atol=2e-6)
        np.testing.assert_allclose(extrapolated[3], exact[3], atol=1e-4)


# --- to the bit -------------------------------------------------------------------------------


def moved(substrate, site=1, pieces=(400,)):
    """Return a chain after a run with strain, a driven end, and its release in mid-step, cut into
    pieces of so many steps, and its recorded ends.
    """
    design = case_ii(substrate, N=61)
    chain = Chain(design)
    chain.place(find_pinned_wall(design, 1))
    t = substep_times(sum(pieces), chain.dt)
    V_N = 0.02 * design.N * np.sin(2.0 * np.pi * t / t[-1])
    driven = t[: len(t) // 3 | 1]
    motion = np.array([design.D_s2 + 0.1 * np.sin(2.1 * driven), 0.21 * np.cos(2.1 * driven)])
    ends, done = [], 0
    for steps in pieces:
        then = done + SUBSTEPS_PER_STEP * steps
        rest = motion[:, done:then]
        held_cell = HeldCell(site, rest) if rest.shape[1] else None
        ends.append(chain.advance(V_N[done:then], held_cell))
        done = then
    return chain, np.hstack(ends)


@SUBSTRATES
@pytest.mark.parametrize('site', [1, 61], ids=['left', 'right'])
@pytest.mark.parametrize(
    'pieces',
    [(1,) * 400, (1, 0, 132, 1, 1, 65, 200), (133, 267), (134, 266), (399, 1)],
    ids=lambda pieces: f'{len(pieces)} pieces, first {pieces[0]}',
)
def test_run_cut_into_pieces_is_same_to_bit(substrate, site, pieces):
    assert sum(pieces) == 400
    whole, whole_ends = moved(substrate, site)
    cut, cut_ends = moved(substrate, site, pieces)
    np.testing.assert_array_equal(cut.state(), whole.state())
    np.testing.assert_array_equal(cut_ends, whole_ends)
    assert (cut.V_N, cut.steps_done) == (whole.V_N, whole.steps_done)


@SUBSTRATES
def test_slices_and_whole_numbers_compile_nothing_new(substrate):
    """A tick loop must not stop for the compiler because a slice is not contiguous."""
    chain, _ = moved(substrate)
    loop = pefrl.advance
    known = len(loop.signatures)
    chain.advance(np.zeros(40)[::2])
    chain.advance(np.zeros(20, dtype=int), HeldCell(1, np.zeros((2, 50))[:, ::5]))
    frozen = np.zeros((2, 10))
    frozen.flags.writeable = False
    chain.advance(np.zeros(20), HeldCell(1, frozen))
    assert len(loop.signatures) == known


@SUBSTRATES
def test_chains_in_threads_give_bits_of_each_alone(substrate):
    """The loops hold no GIL and share nothing: more chains than threads, each with its shake."""

    def shaken(seed):
        chain = Chain(case_ii(substrate))
        shake = 0.02 * np.random.default_rng(seed).standard_normal(400)
        chain.advance(np.zeros(400), shake=shake)
        return chain.state().tobytes()

    alone = [shaken(seed) for seed in range(6)]
    assert len(set(alone)) == 6
    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(shaken, range(6))) == alone


# --- at rest ----------------------------------------------------------------------------------

MAX_REST_TICKS = 60
"""Ticks of 20 time units in which the short, well damped element comes to rest."""


def struck(substrate='rigid'):
    """Return a chain with a wall, one cell of which is off its place by a tenth."""
    design = case_ii(substrate, N=60, eta=0.2)
    chain = Chain(design)
    v = find_pinned_wall(design, 0)
    v[20] += 0.1
    chain.place(v)
    return chain


def count_steps(chain, ticks=1):
    return ticks * round(20.0 / chain.dt)


def hold_still(chain, ticks):
    return np.full(count_steps(chain, ticks) * SUBSTEPS_PER_STEP, chain.V_N)


def pass_ticks(chain, ticks):
    return chain.advance(hold_still(chain, ticks), ticks=ticks)


def at_rest(chain):
    return not (chain.velocity.any() or chain.substrate_velocity.any())


@SUBSTRATES
def test_chain_comes_to_rest_where_it_is(substrate):
    """Up to rest, the bits are those of a chain that never rests; later they are the same ones."""
    chain, restless = struck(substrate), struck(substrate)
    ticks = 0
    while ticks == 0 or not at_rest(chain):
        before = chain.state()
        pass_ticks(chain, 1)
        ticks += 1
        if not at_rest(chain):
            restless.advance_steps(count_steps(chain))
            assert chain.state().tobytes() == restless.state().tobytes()
    assert 10 < ticks < MAX_REST_TICKS
    assert chain.state()[::2].tobytes() == before[::2].tobytes()
    assert 0.0 < np.abs(before[1]).max() < MAX_REST_SPEED
    place = chain.state()
    ends = pass_ticks(chain, 100)
    assert chain.state().tobytes() == place.tobytes()
    assert chain.steps_done == count_steps(chain, ticks + 100)
    assert (ends == [[chain.v[0]], [chain.v[-1]]]).all()
    restless.advance_steps(count_steps(chain, 100))
    # What is left of a wave of REST: its displacement, and roundings of it.
    np.testing.assert_allclose(chain.v, restless.v, atol=100 * MAX_REST_SPEED)


@SUBSTRATES
def test_whatever_moves_chain_wakes_it(substrate):
    def strain(chain):
        V_N = hold_still(chain, 1)
        V_N[-1] = 1e-9
        chain.advance(V_N, ticks=1)

    def shake(chain):
        base = hold_still(chain, 1)
        base[7] = 1e-9
        chain.advance(hold_still(chain, 1), None, base, 1)

    def held_cell(chain):
        motion = np.full((2, SUBSTEPS_PER_STEP), [[chain.v[0] + 1e-9], [0.0]])
        chain.advance(hold_still(chain, 1), HeldCell(1, motion), None, 1)

    def wear(chain):
        alpha = np.ones(chain.design.N)
        alpha[29:31] = 0.9  # under the wall: elsewhere cells rest at minima of any height
        chain.set_specimen(Specimen(chain.design, alpha_factor=alpha))
        pass_ticks(chain, 1)

    def push(chain):
        chain.velocity[10] = 1e-9
        pass_ticks(chain, 1)

    for wake in (strain, shake, held_cell, wear, push):
        chain = struck(substrate)
        pass_ticks(chain, MAX_REST_TICKS)
        assert at_rest(chain)
        place = chain.state()
        wake(chain)
        assert not at_rest(chain)
        assert chain.state()[0].tobytes() != place[0].tobytes()


def test_no_force_on_stuck_cell_disturbs_rest():
    chain = struck()
    chain.set_specimen(Specimen(chain.design, stuck=(21,)))
    pass_ticks(chain, 2 * MAX_REST_TICKS)  # such a cell scatters waves
    assert at_rest(chain)
    assert chain.v[20] - find_pinned_wall(chain.design, 0)[20] == pytest.approx(0.1)


# --- refusals ---------------------------------------------------------------------------------


@SUBSTRATES
def test_step_out_of_range_is_rejected(substrate):
    limit = stable_step(Specimen(case_ii(substrate)))
    Chain(case_ii(substrate), limit)
    for dt in (0.0, -0.1, 1.001 * limit, math.nan, math.inf):
        with pytest.raises(DesignError, match=rf'^dt must be .* {limit:.5g}.*; got'):
            Chain(case_ii(substrate), dt)


@SUBSTRATES
def test_cell_that_leaves_its_range_and_returns_is_detected(substrate):
    """The first cell is pulled out for one step of eight, and put back."""
    design, steps = case_ii(substrate), 8
    still = np.zeros(steps * SUBSTEPS_PER_STEP)
    motion = np.stack((np.full_like(still, design.D_s1), still))
    out = slice(3 * SUBSTEPS_PER_STEP, 4 * SUBSTEPS_PER_STEP)
    chain, other = (Chain(design) for _ in range(2))
    motion[0, out] = chain._range[1] + 1.0
    held_cell = HeldCell(1, motion)
    chain.advance(still, held_cell)  # who looks at the end alone sees nothing
    for ticks in (2, 8):  # after the fourth step and the last, or after every one
        with pytest.raises(StateError, match='left the range'):
            other.advance(still, held_cell, ticks=ticks)
        assert other.state().tobytes() == Chain(design).state().tobytes()


@SUBSTRATES
def test_wrong_states_and_inputs_are_rejected_and_change_nothing(substrate):
    chain, _ = moved(substrate)
    good, before = chain.state(), (chain.state().tobytes(), chain.V_N, chain.steps_done)
    wrong = [
        lambda: chain.restore(good[:, 1:], V_N=0.0, steps_done=0),
        lambda: chain.restore(np.zeros((6 - len(good), 61)), V_N=0.0, steps_done=0),
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
    for field, V_N, held_cell in (
        ('V_N', np.zeros(7), None), ('V_N', np.zeros((2, 5)), None),
        ('V_N', np.full(5, math.nan), None), ('V_N', np.full(5, math.inf), None),
        ('site', np.zeros(10), HeldCell(0, np.zeros((2, 10)))),
        ('site', np.zeros(10), HeldCell(30, np.zeros((2, 10)))),
        ('motion', np.zeros(10), HeldCell(1, np.zeros(10))),
        ('motion', np.zeros(10), HeldCell(1, np.zeros((3, 10)))),
        ('motion', np.zeros(10), HeldCell(1, np.zeros((2, 11)))),
        ('motion', np.zeros(10), HeldCell(1, np.full((2, 10), math.nan))),
    ):  # fmt: skip
        with expect_rejection(StateError, 'out_of_range', field):
            chain.advance(V_N, held_cell)
        assert (chain.state().tobytes(), chain.V_N, chain.steps_done) == before
