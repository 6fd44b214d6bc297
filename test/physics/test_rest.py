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


def struck(substrate='rigid'):
    """Return a chain with a wall, one cell of which is off its place by a tenth."""
    design = dataclasses.replace(CASE_II, N=60, eta=0.2, substrate=substrate)
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
