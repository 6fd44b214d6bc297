# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem tolerance`: how often writes and reads fail when chance has a hand in it.

Elements are made by chance, in one thing at a time: the scatter of the on-site amplification
alpha, of the substrate stiffness s, of the masses, of the ground states (offset), the noise of
the transducers, the vibration of the base (in lattice constants per time unit squared). Every
level is read from both ends and every step up is tried. Counting goes on until enough has failed;
a curve through the foot of the counts tells where one in a thousand fails. Saved are the table of
all batches, the figure and the ledger, with which a study that was interrupted or killed goes on.
No ROS is needed.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from . import campaigns

if TYPE_CHECKING:
    from rich.console import Console

    from ..studies.campaign import Row
    from ..studies.tolerance.study import Tolerance

SUMMARY = 'measure what scatter, noise and vibration a memory stands'


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of this sub-command."""
    parser.add_argument(
        '--design', default='case_2', metavar='FILE|PRESET', help='ROS parameter file or preset'
    )
    parser.add_argument(
        '--kinds', nargs='+', default=(), metavar='KIND',
        help='what chance decides, one at a time: alpha, s, mass, offset, noise, vibration; all '
        'by default',
    )  # fmt: skip
    parser.add_argument('--amounts', type=int, default=8, help='amounts of every kind')
    parser.add_argument('--most', type=int, default=300, help='elements of an amount, at most')
    parser.add_argument('--output', type=Path, default=Path('tolerance'), help='folder')
    campaigns.add_arguments(parser)


def run(arguments: argparse.Namespace) -> int:
    """Run the study; return 0 when it is done, 1 when it cannot be, 2 for a wrong argument."""
    from rich.console import Console

    from ..parameter_file import load
    from ..studies.campaign import CampaignError
    from ..studies.tolerance.study import Tolerance
    from ..studies.tolerance.trial import KINDS

    console = Console()
    try:
        study = Tolerance(
            *load(arguments.design), tuple(arguments.kinds) or KINDS, arguments.amounts,
            arguments.most, arguments.seed,
        )  # fmt: skip
        if arguments.point is not None:
            return _run_point(console, study, arguments.point)
        rows = campaigns.evaluated(
            console, study.campaign(), arguments.output / 'ledger.jsonl', arguments.jobs,
            arguments.cluster, what='batches, at most', rows_of=study.count,
        )  # fmt: skip
        _report(console, study, rows, arguments)
    except ValueError as error:
        print(f'mlmem tolerance: {error}', file=sys.stderr)
        return 2
    except (CampaignError, OSError) as error:
        print(f'mlmem tolerance: {error}', file=sys.stderr)
        return 1
    return 0


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

    from ..studies.tolerance.point import seeds
    from ..studies.tolerance.trial import chance, try_element

    plan = study.campaign()
    plan.check_point(point)
    kind, amount = plan.points[point]['kind'], plan.points[point]['scatter']
    table = Table(title=f'batch {point}: {kind} scatters by {amount:g}')
    for heading in ('seed of the element', 'steps that failed', 'read from left', 'from right'):
        table.add_column(heading)
    for seed in seeds(plan.seed_of(point)):
        trial = try_element(study.design, study.settings, chance(kind, amount), seed)
        failed = [f'{level} to {level + 1}' for level, ok in enumerate(trial.stepped) if not ok]
        read = (' '.join(map(str, decoded)) for decoded in trial.read.values())
        table.add_row(str(seed), ', '.join(failed), *read)
    console.print(table)
    return 0
