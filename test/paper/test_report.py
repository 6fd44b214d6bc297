# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The page: made of the data, whole, and with no place of this machine in it."""

import re
from pathlib import Path

import numpy as np

from mlmem_ros.paper.figure import Quality
from mlmem_ros.paper.gallery import CLAIMS, FIGURES
from mlmem_ros.paper.page import render

DOCS = Path(__file__).parents[2] / 'docs'


def complete(computed):
    return {figure.name: computed[figure.name] for figure in FIGURES}


def test_the_page_changes_with_the_data(small):
    data = complete(small)
    before = render(data, Quality.DRAFT)
    changed = dict(data['4b'])
    changed['delay_paper'] = np.full_like(changed['delay_paper'], 77.7)
    after = render(data | {'4b': changed}, Quality.DRAFT)
    assert '| `delays_by_level` | holds |' in before
    assert '| `delays_by_level` | **fails** |' in after
    eight = ', '.join(['77.7'] * len(changed['delay_paper']))
    assert f'| {eight}; at least 0 apart' in after
    assert '77.7' not in before


def test_every_figure_and_every_quantity_is_on_the_page(small):
    page = render(complete(small), Quality.DRAFT)
    for figure in FIGURES:
        assert f'(figures/{figure.stem}.' in page
        assert figure.caption in page
    for quantity in small['check']['quantity']:
        assert f'| {quantity} |' in page
    for claim in CLAIMS:
        assert (f'| {claim.printed} |' in page) == bool(claim.printed), claim.key


def test_tables_have_one_width(small):
    rows = [
        line for line in render(complete(small), Quality.DRAFT).splitlines() if line[:1] == '|'
    ]
    for line in rows:
        assert len(re.findall(r'(?<!\\)\|', line)) in (3, 6), line


def test_the_links_of_the_committed_page_lead_somewhere():
    page = (DOCS / 'reproduction.md').read_text(encoding='utf-8')
    links = re.findall(r'\]\((?!http)([^)]+)\)', page)
    assert len(re.findall(r'!\[', page)) == len(FIGURES)
    for link in links:
        assert (DOCS / link).is_file(), link
    assert '/home/' not in page
    assert str(Path.cwd()) not in page
    assert 'full quality' in page
