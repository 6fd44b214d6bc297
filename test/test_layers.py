# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Imports run one way: from the bottom of this list to its top, as docs/architecture.md says."""

import ast
from pathlib import Path

ROOT = Path(__file__).parent.parent / 'mlmem_ros'

LAYERS = (
    'physics', 'device', 'analysis', 'rig', 'bag', 'contract', 'session', 'host', 'ros', 'view',
    'testing', 'studies', 'paper', 'bench', 'cli',
)  # fmt: skip
"""A package imports from itself and from those before it; all may import the files beside them."""


def imported(path):
    """Yield every module of the package that a file imports, as its parts below mlmem_ros."""
    here = path.relative_to(ROOT).parts[:-1]
    for node in ast.walk(ast.parse(path.read_text(encoding='utf-8'))):
        if isinstance(node, ast.ImportFrom) and node.level:
            above = here[: len(here) - node.level + 1]
            yield from (
                (*above, *(node.module or '').split('.'), alias.name) for alias in node.names
            )
        elif isinstance(node, ast.ImportFrom) and (node.module or '').startswith('mlmem_ros'):
            yield from ((*node.module.split('.')[1:], alias.name) for alias in node.names)


def room(parts):
    """Return the package of a module, None for the files beside the packages."""
    return next((part for part in parts if part), None) if parts else None


def test_imports_run_one_way():
    upward = []
    for path in sorted(ROOT.rglob('*.py')):
        own = path.relative_to(ROOT).parts[0]
        if own not in LAYERS:
            continue
        for parts in imported(path):
            other = room(parts)
            if other in LAYERS and LAYERS.index(other) > LAYERS.index(own):
                upward.append(f'{path.relative_to(ROOT)} imports {".".join(filter(None, parts))}')
    assert upward == []


def test_every_package_is_in_the_list():
    rooms = {path.parent.name for path in ROOT.glob('*/__init__.py')}
    assert rooms == set(LAYERS)
