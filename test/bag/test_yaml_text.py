# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Any text survives YAML, whatever it looks like; what is no YAML is an error of ours."""

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from mlmem_ros.bag import BagError
from mlmem_ros.bag.yaml_text import dump, load


@settings(deadline=None)
@given(st.dictionaries(st.text(max_size=20), st.text()))
def test_any_text_comes_back(strings):
    assert load(dump(strings)) == strings


@pytest.mark.parametrize(
    'text',
    ['42', '0.5', 'true', 'null', '~', '', ' padded ', 'a: b', '- a', 'x\ny', '\ufeff', '😀'],
)
def test_a_text_is_a_text_to_every_reader(text):
    assert yaml.safe_load(dump({'key': text})) == {'key': text}


def test_every_mapping_is_written_out_in_its_own_order():
    shared = {'sec': 1, 'nsec': 2}
    assert dump({'b': [shared, shared], 'a': ()}) == (
        'b:\n- sec: 1\n  nsec: 2\n- sec: 1\n  nsec: 2\na: []'
    )


@pytest.mark.parametrize('text', ['{', '"\\UFFFFFFFF"', '[' * 2000, 'a: *nowhere'])
def test_what_is_not_yaml_is_an_error_of_ours(text):
    with pytest.raises(BagError, match='must be YAML'):
        load(text)


@pytest.mark.parametrize('value', [object(), '\ud800'])
def test_what_has_no_yaml_form_is_refused(value):
    with pytest.raises(BagError, match='YAML must hold only strings and numbers; got'):
        dump({'what': value})
