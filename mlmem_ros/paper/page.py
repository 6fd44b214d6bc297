# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The page that puts every claim of the paper beside our number: docs/reproduction.md.

Every number on it comes from the data of a run; only the sentences around them are written here.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np

from .claims import CLAIMS, Claim, Finding, Verdict
from .figure import Data, Quality, Study, load_data
from .registry import STUDIES
from .run import FIGURES

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

CAPTIONS = {
    '1c': 'Potential, stiffness and both walls at rest.',
    '2a': 'Lines: Eq. (3) by the ansatzes. Circles: the wall held at X, everything else '
    'relaxed. Below: their difference, which grows where the wall feels a free end.',
    '2b': 'Lines: slow growth of the strain in time. Dots: the strain (x 1e3) at which the '
    'pinned equilibrium ends, by continuation. An arrow: the wall leaves the element.',
    '2c': 'Eq. (2) for the three columns of Fig. 2b.',
    '3a': 'Bars at the right: the propagating bands. They overlap.',
    '3b': 'The pulse of the paper with a carrier of 2.0 and a threshold of 7.5e-5 (i, ii), and '
    'as printed.',
    '4a': 'The device writes levels 1 to 7. Inset: (1) de-pinning, (2) held under strain, (3) '
    'drift by the gradient, (4) pinned again.',
    '4b': 'Delay by level, from both ends.',
    '5': 'The kink is launched at the left and driven until it meets the wall.',
    's1': 'Every level written, then erased.',
    'gradient': 'Both kinds of wall in Case I, with nothing but the gradient.',
    'carriers': 'Above: what the wall returns, and the ring-down of the pulse that hides it. '
    'Below: the thresholds that read every level, plain and compensated for the damping.',
    'peaks': 'One cycle from every level: every other level answers to compression, the others '
    'to tension; none goes back.',
    'launches': 'The printed kick makes no kink; a slowly moved cell starts level 0 every time.',
    'rigidity': 'The elastic substrate, Eq. (1b), against Eq. (1a) alone.',
    'design': 'Case II: pins, strains, the way back to a defect, and the carriers; the design '
    'guide explains them.',
    'retention': 'The base shakes along the chain for 2500 time units, then rests. Dashed: a '
    'constant acceleration that the landscape holds out against no more. SI: default scale.',
    'fast': 'Blue: all writes upward succeed, from every level to every higher one, without a '
    'long rest on the way. Cross: the operating point; the number is of time units per level. '
    'fast_write.md tells more.',
    'energy': 'Heat of a write, marks: work put in. energy.md tells more.',
    'check': 'Lower panel: relative differences of the table below.',
}

DISAGREEMENTS = (
    ('carrier 2.4', 'printed_carrier'),
    ('threshold 7.5e-3', 'printed_threshold'),
    ('non-overlapping bands', 'bands'),
    ('arctan kink within 1.35e-4', 'kink_fit'),
    ('initial velocity -0.6148', 'printed_launch'),
    ('min(s) >> max(k_r, k_s), no number', 'how_rigid'),
)
"""What the print says, and the claim that holds our numbers."""


def load_all(output: Path, studies: Iterable[Study] = STUDIES) -> dict[str, Data]:
    """Return the data of studies that were run into an output folder, by name."""
    return {study.name: load_data(output / FIGURES / f'{study.stem}.npz') for study in studies}


def write_report(output: Path, quality: Quality) -> Path:
    """Write the page for a complete run.

    Args:
        output: Folder that every study was run into.
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
        data: The data of every study, by name.
        quality: With which they were made.
    """
    findings = {claim.key: claim.find(data) for claim in CLAIMS}
    parts = [
        INTRODUCTION.format(quality=quality.value, summary=_summary(findings.values())),
        '## Claims\n',
        _claims(findings),
        '## Where print and physics disagree\n',
        _disagreements(findings),
        '## Figures\n',
        *(_figure(study) for study in STUDIES),
        '## Independent check\n',
        'The second route shares no code with the first: SciPy (DOP853, minimisers, root '
        'finder), closed forms, and the continuum limit. The continuum rows differ because the '
        'lattice is discrete, the unrelaxed barrier because a wall on the lattice relaxes at '
        'every position, and the echo at our step because the integrator damps it.\n',
        _check(data['check']),
    ]
    return '\n'.join(parts)


def _summary(findings: Iterable[Finding]) -> str:
    verdicts = [finding.verdict for finding in findings]
    count = {verdict: verdicts.count(verdict) for verdict in Verdict}
    return (
        f'Of {len(verdicts)} claims **{count[Verdict.HOLDS]} hold**, '
        f'{count[Verdict.IN_PART]} hold in part, and {count[Verdict.FAILS]} fail as printed.'
    )


def _claims(findings: Mapping[str, Finding]) -> str:
    rows = ['| claim | verdict | the paper says | we find | how |', '|---|---|---|---|---|']
    rows += [_claim(claim, findings[claim.key]) for claim in CLAIMS]
    return '\n'.join(rows) + '\n'


def _claim(claim: Claim, finding: Finding) -> str:
    verdict = finding.verdict.value
    strong = verdict if finding.verdict is Verdict.HOLDS else f'**{verdict}**'
    cells = (
        f'`{claim.key}`', strong, f'{claim.sentence} ({claim.place})', finding.numbers, claim.how
    )  # fmt: skip
    return '| ' + ' | '.join(cell.replace('|', r'\|') for cell in cells) + ' |'


def _disagreements(findings: Mapping[str, Finding]) -> str:
    rows = ['| print | what our simulation shows |', '|---|---|']
    rows += [f'| {text} | {findings[key].numbers} |' for text, key in DISAGREEMENTS]
    return '\n'.join(rows) + '\n'


def _figure(study: Study) -> str:
    ending = 'gif' if study.name == 's1' else 'png'
    picture = f'![{study.title}]({FIGURES}/{study.stem}.{ending})'
    return f'### {study.title}\n\n{picture}\n\n{CAPTIONS[study.name]}\n'


def _check(study: Data) -> str:
    rows = ['| quantity | ours | second route | difference | route |', '|---|---|---|---|---|']
    columns = (study[name] for name in ('quantity', 'ours', 'theirs', 'route'))
    for quantity, ours, theirs, route in zip(*columns, strict=True):
        difference = np.abs(ours - theirs)
        rows.append(f'| {quantity} | {ours:.7g} | {theirs:.7g} | {difference:.1e} | {route} |')
    return '\n'.join(rows) + '\n'
