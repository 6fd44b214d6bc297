# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What ament's linters check, without ament.

copyright: the two SPDX lines here; flake8 and pep257: ruff, in `make lint`; xmllint: the rules of
package format 3 (REP 149) and of the catkin changelog (REP 132) that need no network.
"""

import re
import xml.etree.ElementTree as ET
from datetime import date
from email.utils import parseaddr
from itertools import pairwise
from pathlib import Path

ROOT = Path(__file__).parent.parent
HEADER = ['# Copyright 2026 The mlmem_ros authors', '# SPDX-License-Identifier: Apache-2.0']
CODE = ('mlmem_ros', 'mlmem_tools', 'lab', 'test', 'tools', 'launch', 'examples')
SOURCES = sorted(path for folder in CODE for path in (ROOT / folder).rglob('*.py'))

ONCE = ['name', 'version', 'description', 'license']
DEPENDS = {
    'depend',
    'build_depend',
    'build_export_depend',
    'exec_depend',
    'test_depend',
    'doc_depend',
    'buildtool_depend',
    'buildtool_export_depend',
}
OTHER = {'maintainer', 'author', 'url', 'export', 'conflict', 'replace', 'member_of_group'}


def told(path):
    """Return the first two lines of a source after its #! line."""
    lines = path.read_text(encoding='utf-8').splitlines()
    return lines[1:3] if lines and lines[0].startswith('#!') else lines[:2]


def test_every_source_names_copyright_and_license():
    assert len(SOURCES) > 300
    assert [str(path) for path in SOURCES if told(path) != HEADER] == []


def test_the_license_file_matches_package_xml():
    text = (ROOT / 'LICENSE').read_text()
    assert 'Apache License' in text
    assert 'Version 2.0, January 2004' in text
    assert package().find('license').text == 'Apache-2.0'


# package.xml


def package():
    return ET.parse(ROOT / 'package.xml').getroot()


def test_package_xml_is_format_3():
    root = package()
    assert (root.tag, root.get('format')) == ('package', '3')
    assert {child.tag for child in root} <= {*ONCE, *DEPENDS, *OTHER}
    for tag in ONCE:
        assert len(root.findall(tag)) == 1, tag
    assert re.fullmatch(r'[a-z][a-z0-9_]*', root.findtext('name'))
    assert re.fullmatch(r'\d+\.\d+\.\d+', root.findtext('version'))
    assert root.findtext('description').strip()
    assert root.findall('maintainer')
    for maintainer in root.findall('maintainer'):
        assert maintainer.text.strip()
        assert re.fullmatch(r'[^@\s]+@[^@\s]+\.[^@\s]+', parseaddr(maintainer.get('email'))[1])
    assert len(root.findall('export')) == 1
    assert root.findtext('export/build_type') == 'ament_python'


def test_dependencies_are_named_once():
    for tag in DEPENDS:
        names = [element.text for element in package().findall(tag)]
        assert len(names) == len(set(names)), tag
        for name in names:
            assert re.fullmatch(r'[a-z][a-z0-9_-]*', name), name


def test_package_xml_follows_the_order_of_its_schema():
    """Name first, export last, and the same kinds of dependency side by side."""
    tags = [child.tag for child in package()]
    assert tags[:3] == ['name', 'version', 'description']
    assert tags[-1] == 'export'
    changes = [tag for before, tag in pairwise(tags) if before != tag]
    assert len(changes) == len(set(changes))


def test_every_ros_package_that_is_imported_is_declared():
    declared = {element.text for tag in DEPENDS for element in package().findall(tag)}
    imports = re.compile(r'^\s*(?:from|import) (\w+)', re.MULTILINE)
    sources = ROOT.glob('mlmem_[rt]o*/**/*.py')
    found = {name for path in sources for name in imports.findall(path.read_text())}
    ros = {name for name in found if re.search(r'_(msgs|srvs|interfaces)$', name)} | {'rclpy'}
    assert ros <= declared


def test_the_resource_marker_is_there():
    assert (ROOT / 'resource' / package().findtext('name')).is_file()


# CHANGELOG.rst


def test_the_changelog_follows_rep_132():
    """REP 132: a title, then a section per version, newest first, each a list."""
    lines = (ROOT / 'CHANGELOG.rst').read_text(encoding='utf-8').splitlines()
    title = f'Changelog for package {package().findtext("name")}'
    assert lines[:3] == ['^' * len(title), title, '^' * len(title)]
    rulers = [i for i, line in enumerate(lines) if re.fullmatch(r'-+', line)]
    heads = [lines[i - 1] for i in rulers]
    assert all(len(lines[i]) == len(lines[i - 1]) for i in rulers)
    assert heads[0] == 'Forthcoming' or heads[0].startswith(package().findtext('version'))
    for head in heads[heads[0] == 'Forthcoming' :]:
        version, day = re.fullmatch(r'(\d+\.\d+\.\d+) \((\d{4}-\d\d-\d\d)\)', head).groups()
        assert version
        assert date.fromisoformat(day)
    for i in rulers:
        assert lines[i + 1].startswith('* ')


def test_versions_agree():
    version = package().findtext('version')
    assert f"version='{version}'" in (ROOT / 'setup.py').read_text()
