# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A chain in which nothing moves rests: it keeps its place, and wakes for whatever moves it.

A tick takes 20 time units. The short, well damped element rests within 60 of them.
"""

import dataclasses

import numpy as np
import pytest

from mlmem.physics import CASE_II, SUBSTEPS_PER_STEP, Chain, HeldCell, Specimen
from mlmem.physics.cells import MAX_REST_SPEED
from mlmem.physics.equilibrium import find_pinned_wall

SUBSTRATES = pytest.mark.parametrize('substrate', ['rigid', 'elastic'])
LONG = 60


def struck(substrate='rigid', **changes):
    """Return a chain with a wall, one cell of which is off its place by a tenth."""
    changes = {'N': 60, 'eta': 0.2, **changes}
    design = dataclasses.replace(CASE_II, substrate=substrate, **changes)
    chain = Chain(design)
    v = find_pinned_wall(design, 0)
    v[20] += 0.1
    chain.place(v)
    return chain


def steps(chain, ticks=1):
    return ticks * round(20.0 / chain.dt)


def still(chain, ticks):
    return np.full(steps(chain, ticks) * SUBSTEPS_PER_STEP, chain.V_N)


def pass_ticks(chain, ticks):
    return chain.advance(still(chain, ticks), ticks=ticks)


def whole(chain):
    return chain.state().tobytes(), chain.V_N, chain.steps_done


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
            restless.advance_steps(steps(chain))
            assert chain.state().tobytes() == restless.state().tobytes()
    assert 10 < ticks < LONG
    assert chain.state()[::2].tobytes() == before[::2].tobytes()
    assert 0.0 < np.abs(before[1]).max() < MAX_REST_SPEED
    place = chain.state()
    ends = pass_ticks(chain, 100)
    assert chain.state().tobytes() == place.tobytes()
    assert chain.steps_done == steps(chain, ticks + 100)
    assert (ends == [[chain.v[0]], [chain.v[-1]]]).all()
    restless.advance_steps(steps(chain, 100))
    # What is left of a wave of REST: its displacement, and roundings of it.
    np.testing.assert_allclose(chain.v, restless.v, atol=100 * MAX_REST_SPEED)


@SUBSTRATES
def test_rest_does_not_depend_on_how_time_is_divided(substrate):
    """It begins, ends and begins again within one run."""
    chains = [struck(substrate) for _ in range(4)]
    ticks, tick = 200, still(chains[0], 1).size
    V_N = np.zeros((ticks, tick))
    V_N[70:73] = 0.1 * np.interp(np.arange(3 * tick), (0, tick, 3 * tick), (0, 1, 0)).reshape(
        3, -1
    )
    shake = np.zeros_like(V_N)
    shake[140, tick // 2 :] = 1e-3
    seen = []
    for chain, length in zip(chains, (1, 7, 90, ticks), strict=True):
        ends = []
        for first in range(0, ticks, length):
            run = slice(first, first + length)
            n = len(V_N[run])
            ends.append(chain.advance(V_N[run].ravel(), None, shake[run].ravel(), n))
        seen.append((np.concatenate(ends, axis=1).tobytes(), whole(chain)))
    assert at_rest(chains[0])
    assert len(set(seen)) == 1
    rests = (np.diff(np.frombuffer(seen[0][0]).reshape(2, ticks, -1)) == 0.0).all(axis=(0, 2))
    assert rests[[69, 139, 199]].all()
    assert not rests[[70, 72, 140]].any()


@SUBSTRATES
def test_whatever_moves_chain_wakes_it(substrate):
    def strain(chain):
        V_N = still(chain, 1)
        V_N[-1] = 1e-9
        chain.advance(V_N, ticks=1)

    def shake(chain):
        base = still(chain, 1)
        base[7] = 1e-9
        chain.advance(still(chain, 1), None, base, 1)

    def held_cell(chain):
        motion = np.full((2, SUBSTEPS_PER_STEP), [[chain.v[0] + 1e-9], [0.0]])
        chain.advance(still(chain, 1), HeldCell(1, motion), None, 1)

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
        pass_ticks(chain, LONG)
        assert at_rest(chain)
        place = chain.state()
        wake(chain)
        assert not at_rest(chain)
        assert chain.state()[0].tobytes() != place[0].tobytes()


def test_no_force_on_stuck_cell_disturbs_rest():
    chain = struck()
    chain.set_specimen(Specimen(chain.design, stuck=(21,)))
    pass_ticks(chain, 2 * LONG)  # such a cell scatters waves
    assert at_rest(chain)
    assert chain.v[20] - find_pinned_wall(chain.design, 0)[20] == pytest.approx(0.1)
