# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The reference pages match the declarations in the code, and those a live node."""

from pathlib import Path

import reference

ROOT = Path(__file__).parent.parent


def test_reference_pages_are_up_to_date():
    folder, pages = ROOT / 'docs' / 'reference', reference.pages()
    found = {name: (folder / name).read_text(encoding='utf-8') for name in pages}
    assert found == pages, 'run .venv/bin/python scripts/reference.py'


def test_policy_is_up_to_date():
    path = ROOT / 'config' / 'sros2_policy.xml'
    assert path.read_text(encoding='utf-8') == reference.policy(), 'run scripts/reference.py'
