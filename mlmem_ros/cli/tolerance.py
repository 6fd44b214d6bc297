# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem tolerance`: how often writes and reads fail when elements are not made as designed.

Elements are made by chance, with one kind of scatter at a time (the on-site amplification alpha,
the substrate stiffness s, the masses, the ground states), every level is read from both ends and
every step up is tried. Counting goes on until enough has failed; a curve through the foot of the
counts tells the scatter at which one in a thousand fails. Saved are the table of all batches, the
figure and the ledger, with which a study that was interrupted or killed goes on. No ROS needed.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console

    from ..studies.campaign import Row
    from ..studies.tolerance.study import Tolerance

SUMMARY = 'measure which scatter of fabrication a memory stands'


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of this sub-command."""
    from ..physics.presets import PRESETS
    from ..studies.run import cores

    parser.add_argument('--design', default='case_2', choices=PRESETS, help='preset')
    parser.add_argument(
        '--kinds', nargs='+', default=('alpha', 's', 'mass', 'offset'),
        choices=('alpha', 's', 'mass', 'offset'), help='what scatters, one at a time',
    )  # fmt: skip
    parser.add_argument('--amounts', type=int, default=8, help='amounts of every kind')
    parser.add_argument('--most', type=int, default=300, help='elements of an amount, at most')
    parser.add_argument('--seed', type=int, default=0, help='of everything')
    parser.add_argument('--output', type=Path, default=Path('tolerance'), help='folder')
    parser.add_argument('--format', choices=('csv', 'parquet'), default='csv', help='of the table')
    parser.add_argument('--jobs', type=int, default=cores(), help='processes side by side')
    parser.add_argument(
        '--cluster', default='', metavar='ADDRESS',
        help='scheduler of a Dask cluster that is used instead, as tcp://host:8786',
    )  # fmt: skip
    parser.add_argument(
        '--point', type=int, metavar='N', help='count batch N of the table alone, by element'
    )


def run(arguments: argparse.Namespace) -> int:
    """Run the study; return 0 when it is done, 1 when it cannot be, 2 for a wrong argument."""
    from rich.console import Console

    from ..device import Settings
    from ..physics.presets import preset
    from ..studies.campaign import CampaignError
    from ..studies.tolerance.study import Tolerance

    console = Console()
    try:
        study = Tolerance(
            preset(arguments.design), Settings(), tuple(arguments.kinds), arguments.amounts,
            arguments.most, arguments.seed,
        )  # fmt: skip
        if arguments.point is not None:
            return _run_point(console, study, arguments.point)
        arguments.output.mkdir(parents=True, exist_ok=True)
        rows = _count(console, study, arguments)
        _report(console, study, rows, arguments)
    except ValueError as error:
        print(f'mlmem tolerance: {error}', file=sys.stderr)
        return 2
    except (CampaignError, OSError) as error:
        print(f'mlmem tolerance: {error}', file=sys.stderr)
        return 1
    return 0


def _count(console: Console, study: Tolerance, arguments: argparse.Namespace) -> list[Row]:
    """Count what the ledger does not hold yet; return the whole table."""
    from ..studies import campaign
    from ..studies.campaign.progress import with_progress

    plan = study.campaign()
    with campaign.Ledger(arguments.output / 'ledger.jsonl', plan) as ledger:
        done, most = len(ledger.rows), len(plan.points)
        try:
            with campaign.workers(arguments.jobs, arguments.cluster) as executor:
                counted = study.count(ledger, executor)
                for _ in with_progress(console, counted, done, most, 'batches, at most'):
                    pass
        except KeyboardInterrupt:
            console.print(
                f'{len(ledger.rows)} batches are kept in {ledger.path}; give the same command '
                'to go on', highlight=False,
            )  # fmt: skip
            raise
        return ledger.table()


def _report(
    console: Console, study: Tolerance, rows: list[Row], arguments: argparse.Namespace
) -> None:
    """Save table and figure, and print where one in a thousand fails."""
    from rich.table import Table

    from ..studies.campaign import save_table
    from ..studies.style import save_figure, styled
    from ..studies.tolerance.draw import WORDS, draw

    table = Table(title='scatter at which one in a thousand fails')
    for heading in ('scatter of', *WORDS.values()):
        table.add_column(heading)
    for kind in study.kinds:
        table.add_row(kind, *(_rare(study, rows, kind, failure) for failure in WORDS))
    console.print(table)
    files = [save_table(rows, arguments.output / 'batches', arguments.format)]
    with styled():
        files += save_figure(draw(study, rows), arguments.output / 'tolerance')
    console.print('  '.join(str(file) for file in files), highlight=False, soft_wrap=True)


def _rare(study: Tolerance, rows: list[Row], kind: str, failure: str) -> str:
    """Return the scatter at which one in a thousand fails, with its interval, in words."""
    if (found := study.rare(rows, kind, failure)) is not None:
        return f'{found[0]:.2g} ({found[1]:.2g} to {found[2]:.2g})'
    amounts, rates = study.curve(rows, kind, failure)
    if not any(rate.failures for rate in rates):
        return f'none of {rates[-1].trials} failed at {amounts[-1]:g}'
    return 'not told by these counts'


def _run_point(console: Console, study: Tolerance, point: int) -> int:
    """Make the elements of one batch again and print what each did."""
    from rich.table import Table

    from ..physics import Scatter
    from ..studies.tolerance.point import seeds
    from ..studies.tolerance.trial import try_element

    plan = study.campaign()
    plan.check_point(point)
    kind, amount = plan.points[point]['kind'], plan.points[point]['scatter']
    table = Table(title=f'batch {point}: {kind} scatters by {amount:g}')
    for heading in ('seed of the element', 'steps that failed', 'read from left', 'from right'):
        table.add_column(heading)
    for seed in seeds(plan.seed_of(point)):
        trial = try_element(study.design, study.settings, Scatter(**{kind: amount}), seed)
        failed = [f'{level} to {level + 1}' for level, ok in enumerate(trial.stepped) if not ok]
        read = (' '.join(map(str, decoded)) for decoded in trial.read.values())
        table.add_row(str(seed), ', '.join(failed), *read)
    console.print(table)
    return 0
