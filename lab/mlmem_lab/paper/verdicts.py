# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a complete run found, as a result file: every claim with its verdict, every check.

The pages take it from lab/results/paper.json.
"""

from __future__ import annotations

import shutil
from collections import Counter
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..results import BY, ROOT, SHOWN, keep_picture, save
from .figure import Claim, Data, Figure, Judgement, Quality, load_data
from .gallery import CLAIMS, FIGURES, FOLDER


def load_all(output: Path, figures: Iterable[Figure] = FIGURES) -> dict[str, Data]:
    """Return the data of figures that were made in an output folder, by name."""
    return {figure.name: load_data(output / FOLDER / f'{figure.stem}.npz') for figure in figures}


def save_verdicts(output: Path, quality: Quality, folder: Path) -> Path:
    """Write the result file of a complete run into a folder; return its path."""
    command = 'mlmem figures' + quality.pick(' --draft', ' --pages')
    measured = dict.fromkeys(name for figure in FIGURES for name in figure.of)
    of = [*measured, *(each for figure in FIGURES for each in _code(figure))]
    return save(folder / 'paper.json', verdicts(load_all(output)), command, None, of)


def keep(figure: Figure, output: Path) -> None:
    """Put the picture of a figure that was made among those of the pages, if it has one."""
    if figure.ending:
        picture = ROOT / SHOWN[0] / f'{figure.stem}.{figure.ending}'
        shutil.copyfile(output / FOLDER / picture.name, picture)
        keep_picture(picture, f'mlmem figures {figure.name} --pages', [*figure.of, *_code(figure)])


def _code(figure: Figure) -> list[str]:
    return [f'{figure.name}{BY}{figure.compute.__module__}']


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
