# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Fields that describe themselves: legal values, and messages that quote others in one line."""

from __future__ import annotations

import dataclasses
import math

import pytest

from mlmem.schema import describe_field, find_problems, make_printable, short_repr


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


def test_values_at_their_bounds_are_legal():
    lowest = Lamp(cells=1, volts=0, ohms=0.1, offset=-1e300, drift=-5, shade='red', name='')
    highest = Lamp(cells=8, volts=12, ohms=1e300, offset=2, drift=1e300, shade='green')
    others = Lamp(name='x' * 100, lit=True, maker=math.nan)
    for lamp in (Lamp(), lowest, highest, others):
        assert find_problems(lamp) == []


@pytest.mark.parametrize(
    ('field', 'values', 'expected'),
    [
        ('cells', (0, 9, 3.0, True, '3'), 'a whole number from 1 to 8'),
        ('volts', (-1e-9, 12.5, math.nan, False, None), 'a finite number from 0 to 12'),
        ('ohms', (0.0, math.inf), 'a finite number of at least 0.1'),
        ('offset', (3.0,), 'a finite number of at most 2'),
        ('drift', (-math.inf,), 'a finite number'),
        ('shade', ('blue', 1), 'one of red, green'),
        ('name', (7,), 'a text'),
        ('lit', (1,), 'true or false'),
    ],
)
def test_wrong_value_is_one_problem(field, values, expected):
    for value in values:
        (found,) = find_problems(Lamp(**{field: value}))
        assert (found.field, found.expected) == (field, expected)
        assert found.value is value


def test_problems_have_the_order_of_the_fields():
    found = find_problems(Lamp(lit=None, cells=-1, volts=99.0))
    assert [problem.field for problem in found] == ['cells', 'volts', 'lit']


def test_annotation_that_is_a_type_is_checked():
    """A module without `from __future__ import annotations` stores the type itself."""
    plain = dataclasses.make_dataclass('Plain', [('size', int, describe_field(1, 'size'))])
    assert find_problems(plain()) == []
    (found,) = find_problems(plain(1.5))
    assert found == ('size', 1.5, 'a whole number')


def nest(levels, copies):
    """Return a list in a list and so on; with two copies of each, as YAML's aliases make it."""
    value = ['lol']
    for _ in range(levels):
        value = [value] * copies
    return value


@pytest.mark.parametrize(
    'make',
    [
        lambda: 'x' * 5_000_000,
        lambda: b'x' * 5_000_000,
        lambda: list(range(10**6)),
        lambda: {str(n): n for n in range(10**5)},
        lambda: 10**4000,
        lambda: nest(100_000, 1),
        lambda: nest(40, 2),
    ],
    ids=['text', 'bytes', 'list', 'dict', 'number', 'deep', 'aliases'],
)
def test_huge_value_is_clipped(make):
    assert 3 <= len(short_repr(make())) <= 80


def test_no_text_controls_the_terminal():
    shown = make_printable('\x1b[2Jgone\nnext \ud800 größe [/red]')
    assert shown == '\\x1b[2Jgone\\nnext \\ud800 größe [/red]'
    assert shown.encode()
    assert len(make_printable('\n' * 5_000_000)) <= 1000
