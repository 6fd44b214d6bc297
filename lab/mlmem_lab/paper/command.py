# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem figures`: draw the paper's figures from our own simulation, and judge its claims.

Without a name all of them are drawn, and paper.json puts every checkable sentence of the paper
next to our number. Each figure comes as PNG, SVG and data (.npz), a film as GIF.
"""

from __future__ import annotations

import argparse
import shutil
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mlmem_tools.cli.command import JOBS_OPTION, JSON_OPTION, declare_command, declare_option
from mlmem_tools.cli.output import create_console, create_table, print_failure, print_json

from ..results import (
    CHECKOUT_ROOT,
    DEVICE_MODULES,
    PICTURE_FOLDERS,
    RESULT_FOLDER,
    keep_picture,
    save_result,
)
from ..study import count_cores, map_calls
from .figure import Data, Figure, Judgement, PaperClaim, Quality, load_data
from .gallery import FIGURES_BY_NAME, list_claims, make_figure, select_figures

if TYPE_CHECKING:
    from rich.console import Console


def keep_figure_picture(figure: Figure, folder: Path) -> None:
    """Put the picture of a figure that was made among those of the pages, if it has one."""
    if figure.ending:
        picture = CHECKOUT_ROOT / PICTURE_FOLDERS[0] / f'{figure.stem}.{figure.ending}'
        shutil.copyfile(folder / picture.name, picture)
        own_file = f'lab/mlmem_lab/paper/figures/{figure.stem}.py'
        keep_picture(picture, f'mlmem figures {figure.name} --pages', [*figure.modules, own_file])


def judge_claims(data: Mapping[str, Data]) -> dict[str, Any]:
    """Return the claims for which there are all the data, and their counts."""
    claims = {
        claim.key: _summarise_claim(claim, data)
        for claim in list_claims()
        if all(name in data for name in claim.needs)
    }
    count = Counter(claim['verdict'] for claim in claims.values())
    return {
        'counts': {
            'claims': len(claims),
            **{judgement.value: count[judgement.value] for judgement in Judgement},
        },
        'claims': claims,
    }


def _summarise_claim(claim: PaperClaim, data: Mapping[str, Data]) -> dict[str, str]:
    judgement, numbers = claim.judge_data(data)
    return {
        'verdict': judgement.value,
        'paper': f'{claim.sentence} ({claim.place})',
        'finding': numbers,
        'how': claim.how,
        'printed': claim.printed,
        'replaced': claim.replaced,
    }


@declare_command(
    "draw the paper's figures from our simulation, judge its claims",
    declare_option('names', nargs='*', metavar='FIGURE', help='such as 2b; all if none is given'),
    declare_option('--output', type=Path, default=Path('reproduction'), help='folder'),
    declare_option(
        '--pages', action='store_true', help='keep pictures and results for the pages, too'
    ),
    declare_option(
        '--draft', action='store_true', help='coarse sweeps, in seconds: for a quick look'
    ),
    JOBS_OPTION,
    declare_option('--list', action='store_true', help='list the figures and exit'),
    JSON_OPTION,
    text=__doc__,
)
def figures(arguments: argparse.Namespace) -> int:
    """Draw the figures; return 0 when all were drawn, 1 when a file could not be
    written, 2 for a wrong argument.
    """
    console = create_console(aside=arguments.json)
    if arguments.list:
        for figure in FIGURES_BY_NAME.values():
            console.print(f'{figure.name:<10}{figure.title}', highlight=False)
        return 0
    try:
        figures = select_figures(arguments.names)
        if arguments.pages and arguments.draft:
            raise ValueError('--pages takes no draft')
        jobs = count_cores() if arguments.jobs is None else arguments.jobs
        if jobs < 1:
            raise ValueError(f'--jobs must be at least 1; got {jobs}')
        folder = arguments.output / 'figures'
        folder.mkdir(parents=True, exist_ok=True)
    except (KeyError, ValueError) as error:
        return print_failure('figures', error.args[0], 2)
    except OSError as error:
        return print_failure('figures', f'--output must be a writable folder; {error}', 2)
    quality = Quality.DRAFT if arguments.draft else Quality.FULL
    began = time.monotonic()
    made = {figure.name: [Path()] for figure in figures}
    longest_first = sorted(made, key=lambda name: -FIGURES_BY_NAME[name].seconds)
    one = partial(make_figure, quality=quality, folder=folder)
    try:
        map_calls(console, min(jobs, len(made)), 'figures', one, longest_first, then=made.update)
    except OSError as error:
        return print_failure('figures', f'a file could not be written; {error}', 1)
    for name, files in made.items():
        shown = '  '.join(str(file) for file in files if file.suffix != '.npz')
        console.print(f'{name:<10}{shown}', highlight=False, soft_wrap=True)
    data = {figure.name: load_data(folder / f'{figure.stem}.npz') for figure in figures}
    judged = judge_claims(data)
    claims = [*judged['claims'].values()]
    _print_claims(console, claims)
    if len(figures) == len(FIGURES_BY_NAME):
        command = 'mlmem figures' + quality.pick(' --draft', ' --pages')
        modules = [
            *DEVICE_MODULES, 'lab/mlmem_lab/paper', 'lab/mlmem_lab/studies/trace.py',
            'mlmem_tools/checks/quasistatic.py',
        ]  # fmt: skip
        for place in (arguments.output, *([RESULT_FOLDER] if arguments.pages else ())):
            found = save_result(place / 'paper.json', judged, command, modules)
            console.print(f'claims    {found}', highlight=False, soft_wrap=True)
    if arguments.pages:
        for figure in figures:
            keep_figure_picture(figure, folder)
    console.print(f'{len(made)} in {time.monotonic() - began:.0f} s', highlight=False)
    if arguments.json:
        print_json({'figures': made, 'claims': claims})
    return 0


def _print_claims(console: Console, claims: Sequence[Mapping[str, str]]) -> None:
    table = create_table("the paper's claims", 'verdict', 'the paper says', 'we find')
    for claim in claims:
        table.add_row(claim['verdict'], claim['paper'], claim['finding'])
    if claims:
        console.print(table)
