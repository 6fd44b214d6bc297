# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Words in elements, without ROS: what the code corrects, and what a crash leaves of a write."""

from itertools import combinations, product

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mlmem_ros.procedures import BLANK
from mlmem_tools.bank.word_code import LostWord, TornWord, WordCode

SHAPES = [(3, 4, 2), (3, 4, 1), (7, 8, 2), (7, 8, 3), (6, 16, 4), (9, 64, 2), (12, 256, 3)]
QUICK = settings(max_examples=50, deadline=None, derandomize=True)


@st.composite
def written(draw, least=1):
    """A code, a word and its digits."""
    code = WordCode(*draw(st.sampled_from([shape for shape in SHAPES if shape[2] >= least])))
    word = draw(st.integers(0, code.size - 1))
    return code, word, code.digits(word)


@QUICK
@given(written(), st.data())
def test_what_the_code_can_correct_is_corrected(case, data):
    """Unreadable digits cost one check digit each, wrong ones two."""
    code, _, digits = case
    wrong = data.draw(st.integers(0, code.check // 2))
    places = data.draw(st.permutations(range(code.elements - 1)))  # a blank seal is another story
    read = list(digits)
    for place in places[:wrong]:
        read[place] = (digits[place] + data.draw(st.integers(1, code.base - 1))) % code.base
    for place in places[wrong : code.check - wrong]:
        read[place] = data.draw(st.sampled_from([None, BLANK, -2, code.base, 999]))
    assert code.decode(read) == digits


@pytest.mark.parametrize('lost', list(combinations(range(5), 2)))
def test_any_two_of_five_may_be_unreadable(lost):
    """Including the seal."""
    code = WordCode(5, 8, check=2)
    digits = code.digits(0o271)
    read = [None if place in lost else digit for place, digit in enumerate(digits)]
    assert code.decode(read) == digits


@QUICK
@given(written(), st.data())
def test_one_more_unreadable_digit_is_refused(case, data):
    code, _, digits = case
    lost = data.draw(st.permutations(range(code.elements)))[: code.check + 1]
    read = [None if place in lost else digit for place, digit in enumerate(digits)]
    with pytest.raises(LostWord, match=f'{code.check + 1} of {code.elements} digits are unread'):
        code.decode(read)


@pytest.mark.parametrize(('elements', 'base', 'check'), [(3, 4, 2), (4, 8, 2), (4, 8, 3)])
def test_the_chance_of_a_false_word(elements, base, check):
    """Counted over all readings. Three check digits always detect two wrong ones."""
    code = WordCode(elements, base, check)
    taken = {
        read: decoded(code, read) is not None for read in product(range(base), repeat=elements)
    }
    assert sum(taken.values()) / len(taken) == code.chance()
    truth = code.digits(1)
    two = [read for read in taken if sum(a != b for a, b in zip(read, truth, strict=True)) == 2]
    found = [read for read in two if not taken[read]]
    assert found == two if check == 3 else 0 < len(found) < len(two)


@pytest.mark.parametrize(('unreadable', 'chance'), [(0, 29 / 64), (1, 1 / 8), (2, 1.0), (3, 0.0)])
def test_unreadable_digits_leave_less_to_check_with(unreadable, chance):
    """Four elements of eight levels, two to check."""
    assert WordCode(4, 8, 2).chance(unreadable) == chance


@QUICK
@given(written(), written(), st.data())
def test_a_crash_leaves_the_old_word_the_new_one_or_a_torn_one(case, other, data):
    """In every phase, with each of its elements in any state."""
    code, _, new = case
    old = data.draw(st.sampled_from([code.digits(other[1] % code.size), (BLANK,) * code.elements]))
    aim = data.draw(st.sampled_from([new, (BLANK,) * code.elements]))
    phases = code.phases(aim)
    held = list(old)
    cut = data.draw(st.integers(0, len(phases) - 1))
    for phase in phases[:cut]:
        for place, level in phase.items():
            held[place] = level
    for place in phases[cut]:  # half-way: any level, none, or one that nobody can read
        anything = st.integers(0, code.base - 1) | st.sampled_from([BLANK, None])
        held[place] = data.draw(anything)
    changing = cut > 0 and (aim[0] == BLANK or cut == 1)  # the seal stays blank
    if changing and held != [BLANK] * code.elements:
        with pytest.raises(TornWord):
            code.decode(held)
    else:
        assert decoded(code, held) in (old, aim, None)


def decoded(code, read):
    try:
        return code.decode(read)
    except (TornWord, LostWord):
        return None


def test_two_check_digits_keep_a_word_while_its_seal_is_in_doubt():
    """If writing the seal is interrupted at any level, the old or the new word is read."""
    code = WordCode(4, 8, check=2)
    for digits in (code.digits(0o52), code.digits(0o53)):
        for seal in (None, *range(8)):
            assert code.decode([*digits[:-1], seal]) == digits
        with pytest.raises(TornWord, match='a write has not ended, or the seal has lost its wall'):
            code.decode([*digits[:-1], BLANK])


def test_a_mixture_would_pass_for_a_word_without_a_seal():
    """Why there is a seal: with half of the new digits the code mostly finds a third word."""
    code = WordCode(7, 8, check=2)
    old = code.digits(0)
    false = []
    for word in range(1, code.size, 201):
        mixture = [*code.digits(word)[:3], *old[3:]]
        false.append(decoded(code, mixture) not in (None, old, code.digits(word)))
    assert sum(false) / len(false) > 0.5


def test_phases():
    code = WordCode(4, 8, check=2)
    digits = code.digits(0o52)
    assert code.phases(digits) == ({3: BLANK}, dict(enumerate(digits[:3])), {3: digits[3]})
    assert code.phases((BLANK,) * 4) == ({3: BLANK}, dict.fromkeys(range(3), BLANK))
    plain = WordCode(2, 8)
    assert plain.phases(plain.digits(0o52)) == ({0: 2, 1: 5},)


def test_check_digits_are_part_of_what_is_stored():
    """They must not change with the library."""
    assert WordCode(4, 8, 2).digits(0o52) == (2, 5, 1, 6)
    assert WordCode(5, 256, 2).digits(0x030201) == (1, 2, 3, 4, 4)


@pytest.mark.parametrize(
    ('shape', 'why'),
    [
        ((4, 6, 2), 'base must be a power of two from 4 to 256; got 6; use 4 of the levels'),
        ((4, 2, 2), 'base must be a power of two from 4 to 256; got 2$'),
        ((8, 8, 2), 'elements must be at most 7 where digits of base 8 are checked; got 8'),
        ((2, 8, 2), 'check must be from 0 to 1; got 2'),
        ((2, 8, -1), 'check must be from 0 to 1; got -1'),
        ((2, 1, 0), 'base must be at least 2; got 1'),
    ],
)
def test_impossible_codes_are_refused(shape, why):
    with pytest.raises(ValueError, match=why):
        WordCode(*shape)


def test_without_a_code_digits_are_as_read():
    code = WordCode(3, 8)
    assert code.decode([3, BLANK, 1]) == (3, BLANK, 1)
    for bad in (None, 8, -2):
        with pytest.raises(LostWord, match='1 of 3 digits are unreadable; the code can correct 0'):
            code.decode([3, bad, 1])


def test_another_user_of_the_library_makes_no_wrong_word():
    """It keeps its field in globals: a robot may use another one in between."""
    import reedsolo

    code = WordCode(4, 8, check=2)
    reedsolo.init_tables(0x11D)
    digits = code.digits(0o31)
    reedsolo.init_tables(0x13, c_exp=4)
    assert code.decode([*digits[:2], None, None]) == digits
