# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Many elements at once: each as it would be alone, to the bit."""

import dataclasses
import threading

import numpy as np
import pytest

from mlmem_ros.physics import CASE_II, Chain, Drive, StateError
from mlmem_ros.physics.ensemble import Ensemble

STEPS = 60


def designs():
    """Different materials, a shorter chain, and both substrates."""
    return [
        CASE_II,
        dataclasses.replace(CASE_II, gamma=-2e-4),
        dataclasses.replace(CASE_II, d=0.03, eta=0.01),
        dataclasses.replace(CASE_II, N=60, J=9, J_s=18),
        dataclasses.replace(CASE_II, substrate='elastic'),
    ]


def chains():
    made = [Chain(design) for design in designs()]
    for seed, chain in enumerate(made):
        disorder = np.random.default_rng(seed).normal(scale=0.02, size=chain.design.N)
        chain.place(chain.v + disorder, V_N=0.1 * seed)
    return made


def strains():
    """A different ramp for every element."""
    return np.array([0.1 * i + 1e-3 * i * np.arange(2 * STEPS) for i in range(len(designs()))])


def drives():
    motion = np.stack((np.linspace(-1.0, -0.9, 31), np.full(31, 0.01)))
    return [None, Drive(1, motion), None, Drive(60, motion), Drive(1, motion)]


def assert_same_bits(left, right):
    assert left.V_N == right.V_N
    assert left.steps_done == right.steps_done
    np.testing.assert_array_equal(left.state(), right.state())


@pytest.mark.parametrize('workers', [None, 1, 2, 5])
def test_each_element_moves_as_if_alone(workers):
    alone = chains()
    ends = [c.advance(V_N, d) for c, V_N, d in zip(alone, strains(), drives(), strict=True)]
    with Ensemble(chains(), workers) as ensemble:
        np.testing.assert_array_equal(ensemble.advance(strains(), drives()), ends)
        for one, other in zip(ensemble.chains, alone, strict=True):
            assert_same_bits(one, other)


def test_one_strain_for_all():
    alone = chains()
    with Ensemble(chains()) as ensemble:
        ends = ensemble.advance(strains()[2])
        for one, other, seen in zip(ensemble.chains, alone, ends, strict=True):
            np.testing.assert_array_equal(seen, other.advance(strains()[2]))
            assert_same_bits(one, other)


def test_at_rest_every_substrate_stays_where_it_is():
    alone = chains()
    with Ensemble(chains()) as ensemble:
        assert ensemble.rest(STEPS).shape == (len(alone), 2, STEPS)
        for one, other in zip(ensemble.chains, alone, strict=True):
            other.rest(STEPS)
            assert_same_bits(one, other)


def test_runs_may_be_cut_anywhere():
    whole, parts = Ensemble(chains()), Ensemble(chains())
    with whole, parts:
        whole.advance(strains())
        for cut in (slice(0, 14), slice(14, 14), slice(14, 2 * STEPS)):
            parts.advance(strains()[:, cut])
        for one, other in zip(whole.chains, parts.chains, strict=True):
            assert_same_bits(one, other)


def test_more_elements_than_workers():
    made = [Chain(designs()[3]) for _ in range(50)]
    with Ensemble(made, workers=3) as ensemble:
        ensemble.rest(5)
        assert {chain.steps_done for chain in made} == {5}
    assert len(ensemble) == 50


def test_elements_that_are_lost_are_named_and_the_others_advance():
    made, alone = chains(), chains()
    for lost in (1, 3):
        made[lost].velocity[0] = np.nan
    with Ensemble(made) as ensemble:
        with pytest.raises(StateError, match=r'elements \[1, 3\] became non-finite'):
            ensemble.advance(strains())
        for i in (0, 2, 4):
            alone[i].advance(strains()[i])
            assert_same_bits(made[i], alone[i])


@pytest.mark.parametrize(
    ('V_N', 'held', 'reason'),
    [
        (np.zeros((4, 8)), None, r'V_N must have shape \(5, 2 steps\); got \(4, 8\)'),
        (np.zeros((5, 2, 4)), None, 'V_N must have shape'),
        (np.zeros((5, 7)), None, r'V_N must have shape \(2 steps,\); got \(7,\)'),
        (np.where(np.eye(5, 8) * np.arange(8) == 4, np.nan, 0.0), None, 'V_N must be finite'),
        (np.zeros(8), [None] * 4, 'drives must be 5, one per element; got 4'),
        (np.zeros(8), [None] * 4 + [Drive(2, np.zeros((2, 1)))], 'site must be 1 or N = 225'),
    ],
)
def test_bad_inputs_are_refused_before_anything_moves(V_N, held, reason):
    with Ensemble(chains()) as ensemble:
        with pytest.raises(StateError, match=reason):
            ensemble.advance(V_N, held)
        for one, other in zip(ensemble.chains, chains(), strict=True):
            assert_same_bits(one, other)


def test_an_ensemble_needs_different_chains_and_a_worker():
    with pytest.raises(StateError, match='at least one'):
        Ensemble([])
    chain = Chain(CASE_II)
    with pytest.raises(StateError, match='got 2 with 1 different ones'):
        Ensemble([chain, chain])
    with pytest.raises(StateError, match='workers must be at least 1; got 0'):
        Ensemble([chain], workers=0)


def test_its_threads_end():
    def ours():
        return [t for t in threading.enumerate() if t.name.startswith('mlmem-ensemble')]

    with Ensemble(chains()) as ensemble:
        ensemble.rest(1)
        assert ours()
    assert not ours()
