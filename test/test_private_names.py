# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Every private name of a library is listed, and missed in one clear line."""

import ast
import re
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

import mlmem_ros
from mlmem_ros import packages

ROOT = Path(mlmem_ros.__file__).parent
LISTED = {name.rpartition('.')[2] for one in packages.LIBRARIES.values() for name in one.private}

OF_THE_LANGUAGE = {
    '_replace', '_asdict', '_fields', '_fields_',  # of named tuples and of ctypes
    '_exit',  # of the C library
    '_asyncio_future_blocking', '_get_help_string',  # of the standard library, and documented
}  # fmt: skip
"""Names with an underscore that are none of a library."""


def private_names(source):
    """Yield private attributes in a file, and whether they are of `self` or defined there.

    rclpy's compiled module is private as a whole.
    """
    if not re.search(r'\b_[^\W_]|rclpy_implementation', source):
        return
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Attribute):
            of = node.value.id if isinstance(node.value, ast.Name) else ''
            if re.match(r'_[^_]', node.attr) or of == 'rclpy_implementation':
                yield node.attr, of in ('self', 'cls')
        elif isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.AnnAssign):
            name = node.name if not isinstance(node, ast.AnnAssign) else node.target
            yield (name.id if isinstance(name, ast.Name) else str(name)), True


def test_every_private_name_of_a_library_is_listed():
    used, own = {}, set()
    for file in ROOT.rglob('*.py'):
        for name, ours in private_names(file.read_text(encoding='utf-8')):
            own.add(name) if ours else used.setdefault(name, file.relative_to(ROOT))
    foreign = {name: str(file) for name, file in used.items() if name not in own}
    assert {name for name in foreign if name not in OF_THE_LANGUAGE} <= LISTED, foreign


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
