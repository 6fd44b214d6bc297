# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Fields that describe themselves: which values are legal, and the message for others."""

from __future__ import annotations

import dataclasses
import math

import pytest

from mlmem.schema import describe_field, find_descriptions, problems


@dataclasses.dataclass(frozen=True)
class Lamp:
    cells: int = describe_field(3, 'number of cells', low=1, high=8)
    volts: float = describe_field(4.5, 'open-circuit voltage', unit='V', low=0.0, high=12.0)
    ohms: float = describe_field(1.0, 'resistance', unit='ohm', low=0.1)
    offset: float = describe_field(0.0, 'offset', high=2.0)
    drift: float = describe_field(0.0, 'anything finite')
    shade: str = describe_field('red', 'colour', choices=('red', 'green'))
    name: str = describe_field('', 'any text')
    lit: bool = describe_field(False, 'whether it shines')
    maker: object = None  # not described


def test_description_is_kept_with_its_field():
    found = {field.name: description for field, description in find_descriptions(Lamp)}
    assert list(found) == ['cells', 'volts', 'ohms', 'offset', 'drift', 'shade', 'name', 'lit']
    assert found['volts'].text == 'open-circuit voltage'
    assert found['volts'].unit == 'V'
    assert (found['volts'].low, found['volts'].high) == (0.0, 12.0)
    assert found['shade'].choices == ('red', 'green')
    assert Lamp().volts == 4.5
    assert [field.name for field, _ in find_descriptions(Lamp())] == list(found)


def test_values_at_their_bounds_are_legal():
    lowest = Lamp(cells=1, volts=0, ohms=0.1, offset=-1e300, drift=-5, shade='red', name='')
    highest = Lamp(cells=8, volts=12, ohms=1e300, offset=2, drift=1e300, shade='green')
    others = Lamp(name='x' * 100, lit=True, maker=math.nan)
    for lamp in (Lamp(), lowest, highest, others):
        assert problems(lamp) == []


@pytest.mark.parametrize(
    ('values', 'problem'),
    [
        ({'cells': 0}, 'cells must be a whole number from 1 to 8; got 0'),
        ({'cells': 9}, 'cells must be a whole number from 1 to 8; got 9'),
        ({'cells': 3.0}, 'cells must be a whole number from 1 to 8; got 3.0'),
        ({'cells': True}, 'cells must be a whole number from 1 to 8; got True'),
        ({'cells': '3'}, "cells must be a whole number from 1 to 8; got '3'"),
        ({'volts': -1e-9}, 'volts must be a finite number from 0 to 12; got -1e-09'),
        ({'volts': 12.5}, 'volts must be a finite number from 0 to 12; got 12.5'),
        ({'volts': math.nan}, 'volts must be a finite number from 0 to 12; got nan'),
        ({'volts': False}, 'volts must be a finite number from 0 to 12; got False'),
        ({'volts': None}, 'volts must be a finite number from 0 to 12; got None'),
        ({'ohms': 0.0}, 'ohms must be a finite number of at least 0.1; got 0.0'),
        ({'ohms': math.inf}, 'ohms must be a finite number of at least 0.1; got inf'),
        ({'offset': 3.0}, 'offset must be a finite number of at most 2; got 3.0'),
        ({'drift': -math.inf}, 'drift must be a finite number; got -inf'),
        ({'shade': 'blue'}, "shade must be one of red, green; got 'blue'"),
        ({'shade': 1}, 'shade must be one of red, green; got 1'),
        ({'name': 7}, 'name must be a text; got 7'),
        ({'lit': 1}, 'lit must be true or false; got 1'),
    ],
    ids=str,
)
def test_wrong_value_is_one_problem(values, problem):
    assert problems(Lamp(**values)) == [problem]


def test_problems_have_the_order_of_the_fields():
    found = problems(Lamp(lit=None, cells=-1, volts=99.0))
    assert [problem.split()[0] for problem in found] == ['cells', 'volts', 'lit']


def test_annotations_may_be_types_or_strings():
    """A module without `from __future__ import annotations` stores the type itself."""
    plain = dataclasses.make_dataclass(
        'Plain',
        [('size', int, describe_field(1, 'size')), ('on', bool, describe_field(True, 'on'))],
    )
    assert problems(plain()) == []
    assert problems(plain(1.5, 1)) == [
        'size must be a whole number; got 1.5',
        'on must be true or false; got 1',
    ]
