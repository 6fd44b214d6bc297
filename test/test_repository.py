# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a checkout promises: imports that run one way, a licence, declared dependencies, and
generated pages.
"""

import re
import xml.etree.ElementTree as ET
from functools import cache
from pathlib import Path

import pytest

import mlmem

ROOT = Path(__file__).parent.parent
HEADER = ['# Copyright 2026 The mlmem_ros authors', '# SPDX-License-Identifier: Apache-2.0']
CODE = ('mlmem', 'mlmem_ros', 'mlmem_tools', 'lab', 'test', 'scripts', 'launch', 'examples')
PACKAGE = ET.parse(ROOT / 'package.xml').getroot()


def test_sources_name_copyright_and_license():
    sources = [path for folder in CODE for path in (ROOT / folder).rglob('*.py')]
    assert len(sources) > 100
    for path in sources:
        first, *rest = path.read_text(encoding='utf-8').splitlines()
        assert (rest[:2] if first.startswith('#!') else [first, *rest[:1]]) == HEADER, path


def test_imported_ros_packages_are_declared():
    declared = {element.text for element in PACKAGE if element.tag.endswith('depend')}
    imports = re.compile(r'^\s*(?:from|import) (\w+)', re.MULTILINE)
    sources = ROOT.glob('mlmem_[rt]o*/**/*.py')
    found = {name for path in sources for name in imports.findall(path.read_text())}
    assert {name for name in found if re.search(r'_(msgs|srvs|interfaces)$', name)} <= declared


def test_versions_of_setup_and_package_agree():
    version = f"version='{PACKAGE.findtext('version')}'"
    assert version in (ROOT / 'setup.py').read_text(encoding='utf-8')


def test_reference_pages_actions_and_policy_are_up_to_date():
    pytest.importorskip('rclpy')
    import reference

    folder, pages = ROOT / 'docs' / 'reference', reference.pages()
    found = {name: (folder / name).read_text(encoding='utf-8') for name in pages}
    found['sros2_policy.xml'] = (ROOT / 'config/sros2_policy.xml').read_text(encoding='utf-8')
    pages['sros2_policy.xml'] = reference.policy()
    actions = reference.generate_actions()
    found |= {name: (reference.ACTION_FOLDER / name).read_text('utf-8') for name in actions}
    pages |= actions
    assert found == pages, 'run .venv/bin/python scripts/reference.py'


# --- imports: a package imports from itself and from those above it in `LAYERS` ----------------

LAYERS = (
    'mlmem.physics', 'mlmem', 'mlmem_ros.rig', 'mlmem_ros.bag', 'mlmem_ros.contract',
    'mlmem_ros.session', 'mlmem_ros.host', 'mlmem_ros.ros', 'mlmem_ros.testing',
    'mlmem_tools.identification', 'mlmem_tools.checks', 'mlmem_tools.rig', 'mlmem_tools.bank',
    'mlmem_tools.law', 'mlmem_tools.view', 'mlmem_tools.cli',
)  # fmt: skip
"""Packages, from the bottom to the top."""

BASE_MODULES = ('schema', 'errors', 'rng', 'atomic_files', 'parsing', 'threads')
"""Modules of mlmem that any package may use, physics too."""

PARTS = ('mlmem.instrument', 'mlmem.readers', 'mlmem.moves', 'mlmem.procedures')
"""Parts of the library, from the bottom to the top."""
PUBLIC_MODULES = (*BASE_MODULES, 'element_file', 'procedure_table', 'snapshot')
"""Modules of mlmem whose names `mlmem_ros` uses besides those that mlmem exports."""


IMPORT = re.compile(r'^ *(?:from (\.*)([\w.]*) )?import (?:\(([^)]*)\)|(.+))$', re.MULTILINE)


@cache
def list_imports():
    """Return pairs of a module of the packages and a dotted name it imports, perhaps late."""
    found = set()
    for package in ('mlmem', 'mlmem_ros', 'mlmem_tools'):
        for file in (ROOT / package).rglob('*.py'):
            module = '.'.join(file.relative_to(ROOT).with_suffix('').parts)
            text = re.sub('#.*', '', file.read_text(encoding='utf-8'))
            for dots, origin, *names in IMPORT.findall(text):
                parts = module.split('.')[: -len(dots)] if dots else []
                for name in filter(None, re.sub(r' as \w+|\s', '', ''.join(names)).split(',')):
                    found.add((module, '.'.join(filter(None, (*parts, origin, name)))))
    return sorted(found)


def is_within(name, package):
    return f'{name}.'.startswith(f'{package}.')


def find_layer(name, layers):
    """Return the number of a module's layer; None for files that stand beside the layers."""
    numbers = [n for n, layer in enumerate(layers) if is_within(name, layer)]
    return max(numbers, key=lambda number: len(layers[number])) if numbers else None


@pytest.mark.parametrize('layers', [LAYERS, PARTS])
def test_imports_run_one_way(layers):
    upward = []
    for module, imported in list_imports():
        layer, target = (find_layer(name, layers) for name in (module, imported))
        is_base = any(is_within(imported, f'mlmem.{base}') for base in BASE_MODULES)
        if None not in (layer, target) and target > layer and not is_base:
            upward.append(f'{module} imports {imported}')
    assert upward == []


def test_library_imports_no_ros_and_device_public_names_only():
    public = {f'mlmem.{name}' for name in (*mlmem.__all__, *PUBLIC_MODULES)}
    wrong = []
    for module, imported in list_imports():
        package, origin = (name.partition('.')[0] for name in (module, imported))
        is_ros = origin in ('rclpy', 'std_msgs', 'mlmem_ros', 'mlmem_lab')
        is_public = origin != imported and '.'.join(imported.split('.')[:2]) in public
        is_private = origin == 'mlmem' and imported != 'mlmem' and not is_public
        if (package == 'mlmem' and is_ros) or (package == 'mlmem_ros' and is_private):
            wrong.append(f'{module} imports {imported}')
    assert wrong == []
