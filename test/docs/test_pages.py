# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The code and commands of README, tutorials and guides work as printed."""

import os
from pathlib import Path

import pytest
from page import Page

ROOT = Path(__file__).parents[2]
PAGES = [
    ROOT / 'README.md',
    ROOT / 'docs' / 'build_one.md',
    ROOT / 'docs' / 'design.md',
    ROOT / 'docs' / 'faults.md',
    *sorted((ROOT / 'docs' / 'tutorials').glob('*.md')),
]


SLOW = ('own_element',)
"""Pages with a fit."""


@pytest.mark.parametrize(
    'path',
    [pytest.param(path, marks=[pytest.mark.slow] * (path.stem in SLOW)) for path in PAGES],
    ids=lambda path: path.stem,
)
def test_page_works_as_printed(path, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    # A study then runs in this process: to start others takes longer than what they do.
    monkeypatch.setattr(os, 'sched_getaffinity', lambda process: {0}, raising=False)
    Page(path).run()
