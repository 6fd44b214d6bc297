# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a release with bloom needs: every dependency is a package of apt on Jazzy's Ubuntu."""

import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).resolve().parent.parent
KNOWN = yaml.safe_load((ROOT / 'test' / 'data' / 'rosdep.yaml').read_text(encoding='utf-8'))
UBUNTU = 'noble'
PACKAGES = (ROOT / 'package.xml', ROOT / 'mlmem_interfaces' / 'package.xml')


def keys(path):
    """Return the keys of all dependencies in a package.xml."""
    return {each.text for each in ElementTree.parse(path).getroot() if each.tag.endswith('depend')}


def of_apt(key):
    """Return whether rosdep resolves a key to packages of apt."""
    found = KNOWN['rosdep'].get(key)
    if isinstance(found, dict):
        found = found.get(UBUNTU, found.get('*'))
    return key in KNOWN['jazzy'] or isinstance(found, list)


@pytest.mark.parametrize('path', PACKAGES, ids=lambda path: str(path.relative_to(ROOT)))
def test_every_dependency_resolves_to_apt(path):
    assert not [key for key in keys(path) if not of_apt(key)]


def test_a_key_of_pip_does_not():
    assert not any(map(of_apt, ('python3-rosbags-pip', 'mcap-ros2-support', 'python3-unheard-of')))
