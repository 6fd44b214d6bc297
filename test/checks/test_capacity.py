# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How many words an element holds: counted by closed forms, with distances that were tried."""

import itertools
import json

import pytest

from mlmem_ros.device import preset
from mlmem_tools.checks.capacity import Capacity, capacities, shifted
from mlmem_tools.cli.main import main


@pytest.mark.parametrize('distance', [1, 2, 3, 5])
def test_words_in_step_are_sets_of_levels_of_alternating_parity(distance):
    """Counted by trying all sets of ten levels."""

    def in_step(levels):
        apart = [b - a for a, b in itertools.pairwise(levels)]
        last_is_a_wall = not levels or levels[-1] % 2 == 0
        return last_is_a_wall and all(n % 2 and n >= distance for n in apart)

    sets = (each for k in range(11) for each in itertools.combinations(range(10), k))
    assert shifted(10, distance) == sum(map(in_step, sets))


def test_with_a_distance_of_three_a_level_holds_the_logarithm_of_the_plastic_number():
    """Padovan's numbers grow by the root of x^3 = x + 1 each."""
    assert shifted(402, 3) / shifted(400, 3) == pytest.approx(1.324717957**2, rel=1e-6)


@pytest.mark.parametrize(
    ('name', 'kicks', 'shifts'),
    [
        ('case_2', (1, 256), (3, 9)),
        ('bits_4', (2, 2584), (3, 86)),
        ('bits_5', (2, 5_702_887), (3, 7739)),
    ],
)
def test_distances_and_words_of_presets(name, kicks, shifts):
    """As prototypes found them at rest; in motion, with the greater peaks of write and erase."""
    one, *many = capacities(*preset(name))
    assert one.words == preset(name).design.levels + 1
    assert [(each.distance, each.words) for each in many] == [kicks, shifts]


def test_it_follows_the_check_of_a_design(capsys):
    assert main(['design', 'check', 'register_4', '--json']) == 0
    found = {each['way']: each for each in json.loads(capsys.readouterr().out)['capacity']}
    assert found['kicks'] == {
        'way': 'kicks',
        'distance': 1,
        'words': 2048,
        'bits': 11.0,
        'why': '',
    }
    assert 'no actuator' in found['shifting']['why']
    assert main(['design', 'check', 'byte', '--brief']) == 0
    assert '256' in capsys.readouterr().out


def test_more_words_than_an_integer_holds_are_texts():
    told = Capacity('kicks', 2, 2**64).as_dict()
    assert (told['words'], told['bits']) == ('0x10000000000000000', 64.0)
