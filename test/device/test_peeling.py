# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Long registers: walls are shifted in by strain, and read from both ends inward."""

import itertools
import re
import time
from functools import cache

import numpy as np
import pytest

from mlmem_ros.device import (
    UNDECODABLE,
    Abort,
    Disturb,
    Erase,
    Faults,
    Locate,
    Read,
    Write,
    new_element,
    preset,
)
from mlmem_ros.device.presets import shifted
from mlmem_ros.device.procedures.many_walls import passages
from mlmem_ros.device.register import resting
from mlmem_ros.device.waveforms import Cells
from mlmem_ros.device.words import Code, code_of
from mlmem_ros.physics import Specimen, walls
from mlmem_ros.physics.waves import cells

from . import rig

MID = shifted(28)
"""An element of 12 bits, with the cells of `register_8`."""

SHORT = shifted(20)
"""One of 9 bits, which is written in two seconds."""

WORD = 1234
"""One of many walls in `MID`."""


@cache
def code():
    return code_of(MID.design, MID.settings)


def holding(word, kind=MID):
    """Return an element at rest in a word."""
    element = new_element(kind)
    element.chain.place(resting(Specimen(kind.design), element.register.code.walls(word)))
    element.transducer.assume_rest()
    return element


def held(element):
    """Return the levels of the walls that there are."""
    found = walls(element.design, element.chain.configuration)
    return sorted(wall.position / element.design.J - 1.0 for wall in found)


@pytest.mark.parametrize('spacing', [3, 5])
def test_words_are_the_sets_of_levels_at_odd_distances(spacing):
    """Counted by trying all subsets of eleven levels."""
    code = Code(11, spacing, odd=True)
    legal = {
        chosen
        for number in range(12)
        for chosen in itertools.combinations(range(11), number)
        if all(b - a >= spacing and (b - a) % 2 for a, b in itertools.pairwise(chosen))
    }
    assert {code.walls(word) for word in range(code.words)} == legal
    assert all(code.word(code.walls(word)) == word for word in range(code.words))
    assert all(code.allows(each) == (each in legal) for each in [(0, 3), *legal, (0, 2), (2, 11)])


def test_register_8_has_as_many_words_as_64_bits():
    code = code_of(*preset('register_8'))
    assert code.words >= 2**64
    for word in (0, 1, 2**63, 2**64, code.words - 1):
        assert code.word(code.walls(word)) == word


def test_cells_of_any_word_are_those_of_the_element_at_rest():
    """Displacements of neighbours add up: 1e-4 of the stiffness of a cell, 0.2 to 0.6."""
    made, levels = Specimen(MID.design), code().walls(code().words // 3)
    kinds = [(len(levels) - 1 - n) % 2 for n in range(len(levels))]
    phases = np.zeros(MID.design.N, dtype=np.int64)
    for level in levels:
        phases[: MID.design.defect(level)] ^= 1
    near = list(zip(levels, kinds, strict=True))
    found = Cells(made).stiffness(slice(0, MID.design.N), [near], phases[None])[0]
    exact, _, _ = cells(made, resting(made, levels))
    assert found == pytest.approx(exact, abs=1e-4)


@pytest.mark.parametrize('word', [0, 1, WORD, code().words - 1])
def test_any_word_is_read_from_both_ends(word):
    """The kernel's waveforms: blank, the nearest wall, one of many, as many as there may be."""
    outcome = holding(word).perform(Read())
    assert outcome.success, outcome
    assert outcome.reading.level == word
    assert outcome.reading.code == code().binary(word)


@pytest.mark.parametrize('levels', [8, 18])
def test_words_of_a_short_register_are_read(levels):
    """Where a wall moved by four levels would be none of them."""
    kind = shifted(levels)
    words = code_of(kind.design, kind.settings).words
    for word in (1, words // 4, words // 2, words - 1):
        assert holding(word, kind).perform(Read()).reading.level == word


def test_a_word_is_shifted_in_verified_and_annihilated():
    element = new_element(SHORT)
    for word in (34, 10):  # three walls, then two, in the place of these
        outcome = element.perform(Write(word))
        assert outcome.success, outcome
        assert (outcome.reading.level, outcome.attempts) == (word, 1)
        assert held(element) == pytest.approx(element.register.code.walls(word), abs=0.1)
    assert element.perform(Erase()).reading.level == 0
    assert held(element) == []


def test_locate_names_all_walls():
    element = holding(WORD)
    found = element.perform(Locate()).found
    levels = code().walls(WORD)
    assert found['walls'] == len(levels)
    assert found['cells'] == ' '.join(str(MID.design.defect(level)) for level in levels)


def test_an_abort_leaves_what_is_read_or_refused():
    """While walls are on their way, and have come to rest at levels or between them."""
    element = new_element(SHORT)
    for ticks in (700, 1500):
        element.apply(Write(307))
        rig.ticks(element, ticks)
        element.perform(Abort())
        assert element.reading is None
        reading = element.perform(Read()).reading
        if reading is not None and reading.level != UNDECODABLE:
            there = element.register.code.walls(reading.level)
            assert held(element) == pytest.approx(there, abs=0.2)
    assert element.perform(Write(5)).success


@pytest.mark.parametrize(
    'faults',
    [
        Faults(stuck_cell=150),
        Faults(weak_cell=110, weak_factor=0.5),
        Faults(disorder_alpha=3e-3, seed=1),
        Faults(sensor_noise=1e-4, seed=2),
        Faults(damping_factor=2.0),
    ],
)
def test_no_fault_has_a_word_read_as_another(faults):
    element = holding(WORD)
    element.set_faults(faults)
    reading = element.perform(Read()).reading
    assert reading is None or reading.level in (UNDECODABLE, WORD)


@pytest.mark.parametrize(
    ('faults', 'text'),
    [
        (Faults(weak_cell=MID.design.defect(14), weak_factor=0.5), 'nothing is from cell'),
        (Faults(damping_factor=1.2), 'leaves .* times what it may: something else answers'),
    ],
)
def test_a_refusal_says_how_far_it_got(faults, text):
    element = holding(WORD)
    element.set_faults(faults)
    outcome = element.perform(Read())
    assert not outcome.success
    assert re.search(text, outcome.error)


def test_an_answer_counts_at_its_tick_however_long_decoding_takes(monkeypatch):
    """So a replay has it there, too; and what shakes the walls meanwhile spoils it."""
    element = holding(307, SHORT)
    decode = element.register.decode
    soon = element.perform(Read())

    def late(*heard):
        time.sleep(0.3)
        return decode(*heard)

    monkeypatch.setattr(element.register, 'decode', late)
    assert holding(307, SHORT).perform(Read()) == soon
    shaken = holding(307, SHORT)
    run = shaken.apply(Read())
    while run.outcome is None:
        if shaken.ticks == soon.end_tick - 5:
            shaken.apply(Disturb(1e-3))
        shaken.advance()
    assert not run.outcome.success
    assert 'shook' in run.outcome.error


def test_kinks_need_as_many_cycles_as_their_longest_way():
    code = Code(20, 3, odd=True)
    assert passages(code, 0) == 0
    assert passages(code, code.word([3, 8, 13, 18])) == 5 + 4
    assert passages(code, code.word([10])) == 11 + 4  # a kink enters at the left
    assert passages(code, UNDECODABLE) == 24


@pytest.mark.slow
@pytest.mark.parametrize('walls', [range(1, 155, 3), range(0, 155, 5)])
def test_words_with_many_walls_are_read(walls):
    """What comes from the middle has passed 26 walls, and is not cut off."""
    kind = preset('register_8')
    word = code_of(*kind).word(walls)
    assert holding(word, kind).perform(Read()).reading.level == word


@pytest.mark.slow
def test_register_8_is_written_and_read():
    element = new_element(preset('register_8'))
    random = np.random.default_rng(8)
    for _ in range(5):
        word = int.from_bytes(random.bytes(8), 'big')
        assert element.perform(Write(word)).success
        assert element.perform(Read()).reading.level == word


@pytest.mark.slow
def test_random_words_of_a_mid_sized_register():
    element = new_element(MID)
    random = np.random.default_rng(5)
    for word in random.integers(element.words, size=20):
        assert element.perform(Write(int(word))).success
        assert element.perform(Read()).reading.level == word
