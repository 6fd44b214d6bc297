# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Imports run one way, from the bottom of this list to its top: docs/reference/architecture.md."""

import runpy
from pathlib import Path
from types import SimpleNamespace

import pytest

ROOT = Path(__file__).parent.parent
TOOL = SimpleNamespace(**runpy.run_path(str(ROOT / 'tools' / 'architecture.py')))

LAYERS = (
    'physics', 'device', 'rig', 'bag', 'contract', 'session', 'host', 'ros', 'testing',
    'tools.twin', 'tools.checks', 'tools.rig', 'tools.bank', 'tools.law', 'tools.view',
    'tools.cli',
)  # fmt: skip
"""A package imports from itself and from those before it, through the files beside them, too."""


def test_imports_run_one_way():
    packages, files = TOOL.graph()
    assert set(packages) == set(LAYERS)
    found = TOOL.reached({**packages, **files})
    upward = {
        name: above
        for number, name in enumerate(LAYERS)
        if (above := found[name].intersection(LAYERS[number + 1 :]))
    }
    assert upward == {}


def test_an_import_of_itself_is_found():
    with pytest.raises(ValueError, match='cycle'):
        TOOL.reached({'device': {'twin_file'}, 'twin_file': {'twin'}, 'twin': {'device'}})
