# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Every picture is shown on a page, and its caption says what draws it."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DOCS = ROOT / 'docs'
PAGES = [ROOT / 'README.md', *sorted(DOCS.rglob('*.md'))]
SHOWN = re.compile(r'(?:!\[[^\]]*\]\(|src(?:set)?=")([^)"]+\.(?:png|gif|svg))')
DRAWS = re.compile(r'mlmem \w+|mlmem_lab\.\w+|tools/\w+\.py|examples/\w+/\w+\.py|RViz|by hand')


@pytest.mark.parametrize('page', PAGES, ids=lambda page: page.stem)
def test_a_page_says_what_draws_its_pictures(page):
    text = page.read_text(encoding='utf-8')
    for found in SHOWN.finditer(text):
        picture, *behind = text[found.start() :].split('\n\n')
        caption = next((part for part in behind if part[0] not in '!<'), '')
        assert DRAWS.search(picture) or DRAWS.search(caption), found[1]


def test_every_picture_is_on_a_page():
    shown = {
        (page.parent / name).resolve()
        for page in PAGES
        for name in SHOWN.findall(page.read_text(encoding='utf-8'))
    }
    kept = {file for folder in ('images', 'figures') for file in (DOCS / folder).iterdir()}
    assert kept == {file for file in shown if file.parent.name in ('images', 'figures')}
