# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Our YAML equals yaml-cpp's; the expected texts were printed by yaml-cpp 0.8 itself."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mlmem_ros.bag import BagError
from mlmem_ros.bag.yaml_text import dump, load

COLLECTIONS = """\
list:
  - a
  - b: 1
    c:
      -
        - 1
        - 2
none:
  []
map:
  d: e"""


@pytest.mark.parametrize(
    ('value', 'text'),
    [
        ('plain', 'plain'),
        ('two words', 'two words'),
        ('42', '42'),  # yaml-cpp leaves it plain, whatever others make of it
        ('', '""'),
        ('~', '"~"'),
        ('null', '"null"'),
        ('a: b', '"a: b"'),
        ('a:b', 'a:b'),
        ('a:', '"a:"'),
        ('a #b', '"a #b"'),
        ('a#b', 'a#b'),
        ('-', '"-"'),
        ('-1', '-1'),
        ('{"n": 1}', '"{\\"n\\": 1}"'),
        ('x\ny\t', '"x\\ny\\t"'),
        ('R&D', '"R&D"'),
        (' padded ', '" padded "'),
        ('\x07', '"\\x07"'),
        ('größe', 'größe'),
        ('\ufeff', '"\\ufeff"'),
        (None, '~'),
        (True, 'true'),
        (9223372036854775807, '9223372036854775807'),
    ],
)
def test_scalars_are_quoted_where_yaml_cpp_quotes(value, text):
    assert dump({'key': value}) == f'key: {text}'


def test_collections_are_laid_out_as_by_yaml_cpp():
    node = {'list': ['a', {'b': 1, 'c': [[1, 2]]}], 'none': [], 'map': {'d': 'e'}}
    assert dump(node) == COLLECTIONS


@settings(deadline=None)
@given(st.dictionaries(st.text(max_size=20), st.text()))
def test_any_text_comes_back(strings):
    assert load(dump(strings)) == strings


def test_a_key_too_long_for_yaml_is_refused():
    with pytest.raises(BagError, match='at most 1024 characters'):
        dump({'k' * 1025: 'v'})


def test_what_is_not_yaml_is_an_error_of_ours():
    with pytest.raises(BagError, match='must be YAML'):
        load('{')


def test_what_has_no_yaml_form_is_refused():
    with pytest.raises(BagError, match=r'a string, an integer or a boolean; got 0\.5'):
        dump({'half': 0.5})


def test_what_is_empty_is_written_as_yaml_cpp_does():
    assert dump({'a': {}, 'b': []}) == 'a:\n  {}\nb:\n  []'
