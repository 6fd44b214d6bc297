# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Imports run one way: a package imports from itself and from those above it in `LAYERS`."""

import ast
from pathlib import Path

import mlmem

ROOT = Path(__file__).parent.parent

LAYERS = (
    'mlmem.physics', 'mlmem', 'mlmem_ros.rig', 'mlmem_ros.bag', 'mlmem_ros.contract',
    'mlmem_ros.session', 'mlmem_ros.host', 'mlmem_ros.ros', 'mlmem_ros.testing',
    'mlmem_tools.identification', 'mlmem_tools.checks', 'mlmem_tools.rig', 'mlmem_tools.bank',
    'mlmem_tools.law', 'mlmem_tools.view', 'mlmem_tools.cli',
)  # fmt: skip
"""Packages, from the bottom to the top."""

BASE_MODULES = ('schema', 'rejections', 'rng', 'atomic_files', 'parsing', 'threads')
"""Modules of mlmem that any package may use, physics too."""

PARTS = ('mlmem.instrument', 'mlmem.readers', 'mlmem.moves', 'mlmem.procedures')
"""Parts of the library, from the bottom to the top."""
PUBLIC_MODULES = (*BASE_MODULES, 'element_file', 'procedure_table', 'snapshot')
"""Modules of mlmem whose names `mlmem_ros` uses besides those that mlmem exports."""


def list_imports(file):
    """Return the dotted names that a file imports, late imports included."""
    here = file.relative_to(ROOT).parts[:-1]
    found = set()
    for node in ast.walk(ast.parse(file.read_text(encoding='utf-8'))):
        if isinstance(node, ast.ImportFrom):
            parts = here[: len(here) - node.level + 1] if node.level else ()
            origin = '.'.join((*parts, *filter(None, (node.module or '').split('.'))))
            found |= {f'{origin}.{alias.name}' for alias in node.names}
        elif isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
    return found


def find_layer(name):
    """Return the number of a module's layer; None for files that stand beside the layers."""
    numbers = [n for n, layer in enumerate(LAYERS) if f'{name}.'.startswith(f'{layer}.')]
    return max(numbers, key=lambda number: len(LAYERS[number])) if numbers else None


def test_imports_run_one_way_and_library_imports_no_ros():
    upward = []
    for package in ('mlmem', 'mlmem_ros', 'mlmem_tools'):
        for file in sorted((ROOT / package).rglob('*.py')):
            layer = find_layer('.'.join(file.relative_to(ROOT).with_suffix('').parts))
            for imported in list_imports(file):
                base = imported.removeprefix('mlmem.').split('.')[0] in BASE_MODULES
                target = find_layer(imported)
                ros = imported.split('.')[0] in ('rclpy', 'std_msgs', 'mlmem_ros', 'mlmem_lab')
                above = None not in (layer, target) and target > layer and not base
                if above or (ros and package == 'mlmem'):
                    upward.append(f'{file} imports {imported}')
    assert upward == []


def test_library_parts_import_none_above_them():
    upward = []
    for number, part in enumerate(PARTS):
        for file in sorted((ROOT / part.replace('.', '/')).rglob('*.py')):
            above = tuple(f'{part}.' for part in PARTS[number + 1 :])
            upward += [
                f'{file} imports {imported}'
                for imported in list_imports(file)
                if above and f'{imported}.'.startswith(above)
            ]
    assert upward == []


def test_device_imports_only_public_names_of_the_library():
    public = {f'mlmem.{name}' for name in (*mlmem.__all__, *PUBLIC_MODULES)}
    private = [
        f'{file} imports {imported}'
        for file in sorted((ROOT / 'mlmem_ros').rglob('*.py'))
        for imported in list_imports(file)
        if imported.startswith('mlmem.') and '.'.join(imported.split('.')[:2]) not in public
    ]
    assert private == []
