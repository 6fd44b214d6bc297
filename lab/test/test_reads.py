# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Reads in a row, counted: the wall tells what is true, whatever the device says."""

from collections import Counter

import pytest

from mlmem_lab.reads import count
from mlmem_lab.reads.count import (
    READS_PER_MOVE,
    count_rows,
    describe_counts,
    sum_presets,
    true_level,
)


@pytest.fixture
def lies(monkeypatch):
    """Walls are one level beside the place that the device is right about."""
    monkeypatch.setattr(count, 'true_level', lambda element: 1 - true_level(element))


@pytest.mark.parametrize('finer', [1, 2])
def test_every_read_is_counted_after_every_kind_of_move(finer):
    counts = count_rows('bits_1', 4, seed=1, finer=finer)
    assert counts['rows'] == 4
    assert describe_counts(counts)['reads'] == counts['right'] == 4 * READS_PER_MOVE
    assert counts['written'] == 2  # the write, and that after the erase
    assert not describe_counts(counts)['reasons']


def test_proof_catches_a_device_that_lies(lies):
    counts = count_rows('bits_1', 4, seed=1)
    assert counts['wrong'] == 4 * READS_PER_MOVE
    assert counts['wrong rows'] == counts['rows'] == 4
    assert counts['written wrong'] == 2
    assert any(reason.startswith('WRONG: ') for reason in counts)
    assert describe_counts(counts)['wrong rows, at most (95 %)'] == 1.0


def test_counts_of_all_elements_are_summed():
    def counts(right):
        return describe_counts(Counter(right=right, rows=1))

    found = sum_presets({
        'bits_1': {'ideal': counts(1), 'scattered': counts(2)},
        'bits_2': {'ideal': counts(4), 'scattered': counts(8)},
    })  # fmt: skip
    assert [found[kind]['reads'] for kind in ('ideal', 'scattered', 'all')] == [5, 10, 15]
