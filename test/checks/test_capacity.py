# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How many words an element holds: counted by closed forms, with distances that were tried."""

import json

import pytest

from mlmem import load_element
from mlmem_tools import checks
from mlmem_tools.checks.capacity import Capacity, list_capacities
from mlmem_tools.cli.main import main


@pytest.mark.parametrize(
    ('name', 'kicks'),
    [
        ('case_2', (1, 256)),
        ('bits_4', (2, 2584)),
    ],
)
def test_distances_and_words_of_presets(name, kicks):
    """As prototypes found them at rest."""
    one, *many = list_capacities(*load_element(name).design_and_settings)
    assert one.words == load_element(name).design.levels + 1
    assert [(each.distance, each.words) for each in many] == [kicks]


def test_capacity_follows_the_check_of_a_design(capsys, monkeypatch):
    monkeypatch.setattr(checks, 'CHECK_MODULES', ())  # which take a second
    assert main(['design', 'check', 'register_4', '--json']) == 0
    found = {each['way']: each for each in json.loads(capsys.readouterr().out)['capacity']}
    assert found['kicks'] == {
        'way': 'kicks',
        'distance': 1,
        'words': 2048,
        'bits': 11.0,
        'why': '',
    }
    assert main(['design', 'check', 'byte', '--brief']) == 0
    assert '256' in capsys.readouterr().out


def test_more_words_than_json_keeps_are_a_double():
    told = Capacity('kicks', 2, 2**64).as_dict()
    assert (told['words'], told['bits']) == (2.0**64, 64.0)
