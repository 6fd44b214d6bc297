# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What users get with a checkout: a licence, declared dependencies, and generated pages."""

import re
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

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
