# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A private name that a library lacks is reported in one line."""

import sys
from types import SimpleNamespace

import pytest

from mlmem_ros import packages


@pytest.mark.parametrize('library', packages.LIBRARIES)
def test_the_names_are_there_in_this_version_which_is_tested(library):
    pytest.importorskip(library)
    packages.look(library)
    assert packages.tested(library), packages.version(library)
    assert all(packages.is_there(name) for name in packages.LIBRARIES[library].private)


@pytest.mark.parametrize(
    ('found', 'tested'),
    [('0.57.1', False), ('0.58', True), ('0.60.0', True), ('0.68.9', True), ('0.69', False),
     ('1.0', False), ('', False)],
)  # fmt: skip
def test_a_version_is_tested_or_not(monkeypatch, found, tested):
    monkeypatch.setattr(packages, 'version', lambda library: found)
    assert packages.tested('numba') is tested


def test_a_name_that_has_moved_to_a_base_class_is_there(monkeypatch):
    """In rclpy 10.0.10 the constructor that sets `_parameter_overrides` is of `BaseNode`."""

    class BaseNode:
        def __init__(self):
            self._parameter_overrides = {}

    class Node(BaseNode):
        """Says nothing of it."""

    monkeypatch.setitem(sys.modules, 'rclpy_10', SimpleNamespace(Node=Node))
    assert packages.is_there('rclpy_10:Node._parameter_overrides')
    assert not packages.is_there('rclpy_10:Node._initial_parameters')


def test_a_name_that_has_moved_is_missed_in_one_line(monkeypatch):
    moved = packages.LIBRARIES['numba']._replace(
        private=(
            'numba.core.caching:Cache._index_of_keys',
            'numba.attic:Loft._key',
            'numba.core.caching:FunctionCache._index_key',
        )
    )
    monkeypatch.setitem(packages.LIBRARIES, 'numba', moved)
    monkeypatch.setattr(packages, 'version', lambda library: '0.99')
    with pytest.raises(ImportError) as missed:
        packages.look('numba')
    assert str(missed.value) == (
        'numba 0.99 lacks numba.core.caching.Cache._index_of_keys, numba.attic.Loft._key; '
        'mlmem_ros is tested with numba 0.58 to 0.68: install one of these'
    )
