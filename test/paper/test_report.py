# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The page: made of the data, whole, and with no place of this machine in it."""

import re
from pathlib import Path

import numpy as np

from mlmem_ros.paper.claims import CLAIMS
from mlmem_ros.paper.figure import Quality
from mlmem_ros.paper.page import CAPTIONS, DISAGREEMENTS, render
from mlmem_ros.paper.registry import STUDIES

DOCS = Path(__file__).parents[2] / 'docs'


def complete(computed):
    return {study.name: computed[study.name] for study in STUDIES}


def test_the_page_changes_with_the_data(small):
    data = complete(small)
    before = render(data, Quality.DRAFT)
    changed = dict(data['4b'])
    changed['delay_paper'] = np.full_like(changed['delay_paper'], 77.7)
    after = render(data | {'4b': changed}, Quality.DRAFT)
    assert '| `delays_by_level` | holds |' in before
    assert '| `delays_by_level` | **fails** |' in after
    assert '77.7' in after
    assert '77.7' not in before


def test_every_figure_and_every_quantity_is_on_the_page(small):
    page = render(complete(small), Quality.DRAFT)
    for study in STUDIES:
        assert f'(figures/{study.stem}.' in page
        assert CAPTIONS[study.name] in page
    for quantity in small['check']['quantity']:
        assert f'| {quantity} |' in page
    assert {key for _, key in DISAGREEMENTS} <= {claim.key for claim in CLAIMS}


def test_tables_have_one_width(small):
    rows = [
        line for line in render(complete(small), Quality.DRAFT).splitlines() if line[:1] == '|'
    ]
    for line in rows:
        assert len(re.findall(r'(?<!\\)\|', line)) in (3, 6), line


def test_the_links_of_the_committed_page_lead_somewhere():
    page = (DOCS / 'reproduction.md').read_text(encoding='utf-8')
    links = re.findall(r'\]\((?!http)([^)]+)\)', page)
    assert len(links) == len(STUDIES)
    for link in links:
        assert (DOCS / link).is_file(), link
    assert '/home/' not in page
    assert str(Path.cwd()) not in page
    assert 'full quality' in page
