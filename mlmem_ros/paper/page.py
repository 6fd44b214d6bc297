# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The page that puts every claim of the paper beside our number: docs/reproduction.md.

Every number on it comes from the data of a run; only the sentences around them are written here.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np

from .figure import Claim, Data, Figure, Judged, Judgement, Quality, load_data
from .gallery import CLAIMS, FIGURES
from .run import FOLDER

INTRODUCTION = """\
# The paper, reproduced

Pechac & Frazier, *Mechanical multi-level memory from multi-stable metamaterial*, Appl. Phys.
Lett. 122, 211701 (2023), [doi 10.1063/5.0153438](https://doi.org/10.1063/5.0153438).
Every data figure is drawn from our own simulation, and every checkable sentence stands beside
our number. `mlmem figures` makes all of it, this page included ({quality} quality); `mlmem
figures 2b` makes one figure. Each comes as PNG, SVG and data (`.npz`).

{summary}

Units are the paper's: lengths in lattice constants, times in sqrt(m / k_r). A wall's position X
is where the configuration crosses the barrier top, j counts cells from 1, and x = j - 100.
"""


def load_all(output: Path, figures: Iterable[Figure] = FIGURES) -> dict[str, Data]:
    """Return the data of figures that were made in an output folder, by name."""
    return {figure.name: load_data(output / FOLDER / f'{figure.stem}.npz') for figure in figures}


def write_page(output: Path, quality: Quality) -> Path:
    """Write the page for a complete run.

    Args:
        output: Folder that every figure was made in.
        quality: With which quality.

    Returns:
        The page.
    """
    data = load_all(output)
    page = output / 'reproduction.md'
    page.write_text(render(data, quality), encoding='utf-8')
    return page


def render(data: Mapping[str, Data], quality: Quality) -> str:
    """Return the page as Markdown.

    Args:
        data: The data of every figure, by name.
        quality: With which they were made.
    """
    found = {claim.key: claim.judged(data) for claim in CLAIMS}
    parts = [
        INTRODUCTION.format(quality=quality.value, summary=_summary(found.values())),
        '## Claims\n',
        _table(
            'claim | verdict | the paper says | we find | how',
            (_claim(claim, found[claim.key]) for claim in CLAIMS),
        ),
        '## Where print and physics disagree\n',
        _table(
            'print | what our simulation shows',
            ((each.printed, found[each.key].numbers) for each in CLAIMS if each.printed),
        ),
        '## Figures\n',
        *(_figure(figure) for figure in FIGURES),
        '## Independent check\n',
        'The second route shares no code with the first: SciPy (DOP853, minimisers, root '
        'finder), closed forms, and the continuum limit. The continuum rows differ because the '
        'lattice is discrete, the unrelaxed barrier because a wall on the lattice relaxes at '
        'every position, and the echo at our step because the integrator damps it.\n',
        _check(data['check']),
    ]
    return '\n'.join(parts)


def _summary(found: Iterable[Judged]) -> str:
    count = Counter(one.judgement for one in found)
    return (
        f'Of {count.total()} claims **{count[Judgement.HOLDS]} hold**, '
        f'{count[Judgement.IN_PART]} hold in part, and {count[Judgement.FAILS]} fail as printed.'
    )


def _table(headings: str, rows: Iterable[Sequence[str]]) -> str:
    """Return a table in Markdown; a bar in a cell is escaped."""
    lines = [f'| {headings} |', '|' + '---|' * (headings.count('|') + 1)]
    lines += ['| ' + ' | '.join(cell.replace('|', r'\|') for cell in row) + ' |' for row in rows]
    return '\n'.join(lines) + '\n'


def _claim(claim: Claim, one: Judged) -> tuple[str, ...]:
    word = one.judgement.value
    strong = word if one.judgement is Judgement.HOLDS else f'**{word}**'
    return f'`{claim.key}`', strong, f'{claim.sentence} ({claim.place})', one.numbers, claim.how


def _figure(figure: Figure) -> str:
    picture = f'![{figure.title}]({FOLDER}/{figure.stem}.{figure.ending})'
    return (
        f'### {figure.title}\n\n{picture}\n\n{figure.caption} '
        f'Drawn by `mlmem figures {figure.name}`.\n'
    )


def _check(data: Data) -> str:
    columns = (data[name] for name in ('quantity', 'ours', 'theirs', 'route'))
    return _table(
        'quantity | ours | second route | difference | route',
        (
            (quantity, f'{ours:.7g}', f'{theirs:.7g}', f'{np.abs(ours - theirs):.1e}', route)
            for quantity, ours, theirs, route in zip(*columns, strict=True)
        ),
    )
