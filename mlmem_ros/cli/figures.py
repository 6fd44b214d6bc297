# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem figures`: draw the paper's figures from our own simulation, and judge its claims.

Without a name all of them are drawn, with a page reproduction.md that puts every checkable
sentence of the paper next to our number. Each figure comes as PNG, SVG and data (.npz); the film
as GIF. No ROS is needed.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import TYPE_CHECKING

from .campaigns import JOBS
from .command import JSON, command, option
from .output import complain, plain_console, plain_table, print_json

if TYPE_CHECKING:
    from rich.console import Console

    from ..paper.figure import Figure
    from ..paper.run import Done


@command(
    "draw the paper's figures from our simulation, judge its claims",
    option('names', nargs='*', metavar='FIGURE', help='such as 2b; all if none is given'),
    option('--output', type=Path, default=Path('reproduction'), help='folder'),
    option('--draft', action='store_true', help='coarse sweeps, in seconds: for a quick look'),
    JOBS,
    option('--list', action='store_true', help='list the figures and exit'),
    JSON,
    text=__doc__,
)
def figures(arguments: argparse.Namespace) -> int:
    """Draw the figures; return 0 when all were drawn, 1 when a file could not be
    written, 2 for a wrong argument.
    """
    from ..paper.figure import Quality
    from ..paper.gallery import FIGURES, select
    from ..paper.page import write_page

    console = plain_console(aside=arguments.json)
    if arguments.list:
        for figure in FIGURES:
            console.print(f'{figure.name:<10}{figure.title}', highlight=False)
        return 0
    try:
        figures = select(arguments.names)
        if arguments.jobs < 1:
            raise ValueError(f'--jobs must be at least 1; got {arguments.jobs}')
        arguments.output.mkdir(parents=True, exist_ok=True)
    except (KeyError, ValueError) as error:
        return complain('figures', error.args[0], 2)
    except OSError as error:
        return complain('figures', f'--output must be a writable folder; {error}', 2)
    quality = Quality.DRAFT if arguments.draft else Quality.FULL
    began = time.monotonic()
    try:
        done = _draw(console, figures, quality.value, arguments)
    except OSError as error:
        return complain('figures', f'a file could not be written; {error}', 1)
    for item in sorted(
        done, key=lambda item: [figure.name for figure in figures].index(item.name)
    ):
        files = '  '.join(str(file) for file in item.files if file.suffix != '.npz')
        console.print(f'{item.name:<10}{files}', highlight=False, soft_wrap=True)
    claims = _print_claims(console, figures, arguments.output)
    if len(figures) == len(FIGURES):
        page = write_page(arguments.output, quality)
        console.print(f'page      {page}', highlight=False, soft_wrap=True)
    console.print(f'{len(done)} in {time.monotonic() - began:.0f} s', highlight=False)
    if arguments.json:
        made = {item.name: item.files for item in done}
        print_json({'figures': made, 'claims': claims})
    return 0


def _draw(
    console: Console, figures: list[Figure], quality: str, arguments: argparse.Namespace
) -> list[Done]:
    from rich.progress import (
        BarColumn,
        Progress,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    from ..paper.figure import Quality
    from ..paper.run import run

    columns = (
        TextColumn('{task.description:<26}'), BarColumn(), TimeElapsedColumn(),
        TextColumn('left'), TimeRemainingColumn(),
    )  # fmt: skip
    cost = {figure.name: figure.seconds for figure in figures}
    done = []
    with Progress(*columns, console=console) as progress:
        task = progress.add_task(f'0 of {len(figures)} figures', total=sum(cost.values()))
        for item in run(figures, Quality(quality), arguments.output, arguments.jobs):
            done.append(item)
            progress.update(
                task, advance=cost[item.name],
                description=f'{len(done)} of {len(figures)} figures',
            )  # fmt: skip
    return done


def _print_claims(console: Console, figures: list[Figure], output: Path) -> list[dict[str, str]]:
    """Print and return the verdict on every claim for which these figures have all the data."""
    from rich.text import Text

    from ..paper.figure import Judgement
    from ..paper.gallery import CLAIMS
    from ..paper.page import load_all

    data = load_all(output, figures)
    colors = {Judgement.HOLDS: 'green', Judgement.IN_PART: 'yellow', Judgement.FAILS: 'red'}
    table = plain_table("the paper's claims", 'verdict', 'the paper says', 'we find')
    claims = []
    for claim in CLAIMS:
        if all(name in data for name in claim.needs):
            judgement, numbers = claim.judged(data)
            text = Text(judgement.value, colors[judgement])
            table.add_row(text, claim.sentence, numbers)
            claims.append(
                {'verdict': judgement.value, 'paper': claim.sentence, 'finding': numbers}
            )
    if table.row_count:
        console.print(table)
    return claims
