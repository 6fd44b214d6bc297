# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The result file of the figures: made of the data, whole."""

import json

import numpy as np

from mlmem_lab.paper.command import verdicts
from mlmem_lab.paper.gallery import CLAIMS, FIGURES
from mlmem_tools.cli.output import plain


def complete(computed):
    return {figure.name: computed[figure.name] for figure in FIGURES}


def test_a_verdict_changes_with_the_data(small):
    data = complete(small)
    before = verdicts(data)['claims']['delays_by_level']
    changed = data['4b'] | {'delay_paper': np.full_like(data['4b']['delay_paper'], 77.7)}
    after = verdicts(data | {'4b': changed})['claims']['delays_by_level']
    assert (before['verdict'], after['verdict']) == ('with other numbers', 'fails')
    assert '77.7, 77.7' in after['finding']
    assert '77.7' not in before['finding']


def test_every_claim_and_every_quantity_is_in_it(small):
    found = json.loads(json.dumps(plain(verdicts(complete(small)))))
    assert list(found['claims']) == [claim.key for claim in CLAIMS]
    counts = found['counts']
    assert counts.pop('claims') == sum(counts.values()) == len(CLAIMS)
    assert [row['quantity'] for row in found['check']] == list(small['check']['quantity'])
