# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a complete run found, as a result file: every claim with its verdict, every check.

The pages take it from lab/results/paper.json.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..results import save
from .figure import Claim, Data, Figure, Judgement, Quality, load_data
from .gallery import CLAIMS, FIGURES, FOLDER

MEASURED = ('case_1', 'case_2', 'fast', 'bits_4')
"""The presets that the figures show."""


def load_all(output: Path, figures: Iterable[Figure] = FIGURES) -> dict[str, Data]:
    """Return the data of figures that were made in an output folder, by name."""
    return {figure.name: load_data(output / FOLDER / f'{figure.stem}.npz') for figure in figures}


def save_verdicts(output: Path, quality: Quality) -> Path:
    """Write the result file of a complete run; return its path."""
    command = 'mlmem figures' + quality.pick(' --draft', '')
    return save(output / 'paper.json', verdicts(load_all(output)), command, of=MEASURED)


def verdicts(data: Mapping[str, Data]) -> dict[str, Any]:
    """Return claims, their counts, the independent check, and what figures keep, from all data."""
    claims = {claim.key: _claim(claim, data) for claim in CLAIMS}
    count = Counter(claim['verdict'] for claim in claims.values())
    kept = [figure for figure in FIGURES if figure.summary is not None]
    return {
        'counts': {
            'claims': len(claims),
            **{judgement.value: count[judgement.value] for judgement in Judgement},
        },
        'claims': claims,
        'check': _check(data['check']),
        **{figure.name: figure.summary(data[figure.name]) for figure in kept if figure.summary},
    }


def _claim(claim: Claim, data: Mapping[str, Data]) -> dict[str, str]:
    judgement, numbers = claim.judged(data)
    return {
        'verdict': judgement.value,
        'paper': f'{claim.sentence} ({claim.place})',
        'finding': numbers,
        'how': claim.how,
        'printed': claim.printed,
        'replaced': claim.replaced,
    }


def _check(data: Data) -> list[dict[str, Any]]:
    columns = (data[name] for name in ('quantity', 'ours', 'theirs', 'route'))
    return [
        {
            'quantity': str(quantity),
            'ours': float(ours),
            'theirs': float(theirs),
            'difference': float(np.abs(ours - theirs)),
            'route': str(route),
        }
        for quantity, ours, theirs, route in zip(*columns, strict=True)
    ]
