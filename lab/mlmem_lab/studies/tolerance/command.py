# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem tolerance`: count how often writes and reads fail in imperfect elements.

Elements are made at random. The study finds the amounts at which failures begin and counts each
until enough have failed; a curve through the lowest counts shows where one in a thousand fails.
Every curve is saved when it is known; the same command continues after a kill.
"""

from __future__ import annotations

import argparse
import shutil
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mlmem_tools.cli.command import JOBS_OPTION, JSON_OPTION, declare_command, declare_option
from mlmem_tools.cli.output import create_console, create_table, print_failure, print_json

from ...study import map_kept

if TYPE_CHECKING:
    from rich.console import Console

    from .element import Row
    from .study import Tolerance


STUDIED_MODULES = (
    'mlmem',
    *(f'lab/mlmem_lab/studies/tolerance/{name}.py' for name in ('element', 'estimate', 'study')),
)

AMOUNT_COUNT = 10


@declare_command(
    'measure how much scatter, noise and vibration a memory tolerates',
    declare_option(
        '--design', default='case_2', metavar='ELEMENT', help='shipped element or element file'
    ),
    declare_option(
        '--kinds',
        nargs='+',
        default=(),
        metavar='KIND',
        help='what varies: scatter of alpha, k_r, s, mass, offset, depth; noise; vibration in '
        'cells/time^2; damping; gain; or several at once, as alpha+mass; each by default',
    ),
    declare_option(
        '--tried',
        nargs='+',
        default=(),
        metavar='WHAT',
        help='step, left, right (a read from that end), all by default; kick (from blank); of '
        'many walls, word (written) or hear (read)',
    ),
    declare_option('--amounts', type=int, default=AMOUNT_COUNT, help='amounts per decade'),
    declare_option('--most', type=int, default=3000, help='most trials of an amount'),
    declare_option('--output', type=Path, default=Path('tolerance'), help='folder'),
    declare_option('--figure', type=Path, metavar='PNG', help='draw the figure here, too'),
    declare_option(
        '--result', type=Path, help='result file; what it has of other designs is kept'
    ),
    declare_option('--seed', type=int, default=0, help='of all random numbers'),
    JOBS_OPTION,
    JSON_OPTION,
    text=__doc__,
)
def tolerance(arguments: argparse.Namespace) -> int:
    """Run the study; return 0 when it is done, 1 when it cannot be, 2 for a wrong argument."""
    from mlmem import load_element

    from .element import ALL_KINDS
    from .study import Tolerance, count_curve

    console = create_console(aside=arguments.json)
    try:
        study = Tolerance(
            *load_element(arguments.design).design_and_settings,
            tuple(arguments.kinds) or ALL_KINDS, tuple(arguments.tried), arguments.amounts,
            arguments.most, arguments.seed,
        )  # fmt: skip
    except ValueError as error:
        return print_failure('tolerance', error, 2)
    try:
        file = arguments.output / 'curves.json'
        curves = map_kept(
            console, 'curves', count_curve, study.tasks, arguments.jobs, file, study.definition
        )
        _report_rates(console, study, curves, arguments)
    except (ValueError, OSError) as error:
        return print_failure('tolerance', error, 1)
    return 0


def _report_rates(
    console: Console, study: Tolerance, curves: dict[str, list[Row]], arguments: argparse.Namespace
) -> None:
    """Save the figure, and print where one in a thousand fails."""
    from ..style import save_figure, style_context
    from .draw import TRIAL_LABELS, draw_rates
    from .study import describe_rare_amount

    headings = ('scatter of', *(TRIAL_LABELS[tried] for tried in study.tried))
    table = create_table('scatter at which one in a thousand fails', *headings)
    rates: dict[str, dict[str, dict[str, Any]]] = {}
    for kind in study.kinds:
        found = {
            tried: describe_rare_amount(curves[f'{kind} {tried}'], study.seed)
            for tried in study.tried
        }
        table.add_row(kind, *(text for _, text in found.values()))
        rates[kind] = {
            tried: {'amount': amount, 'text': text} for tried, (amount, text) in found.items()
        }
    console.print(table)
    with style_context():
        files = save_figure(draw_rates(study, curves), arguments.output / 'tolerance')
    made = f'mlmem tolerance --design {arguments.design} --kinds {" ".join(study.kinds)}'
    made += ' '.join(('', '--tried', *study.tried)) + f' --most {arguments.most}'
    if arguments.figure is not None:
        from ...results import keep_picture

        shutil.copyfile(arguments.output / 'tolerance.png', arguments.figure)
        command = f'{made} --figure {arguments.figure}'
        keep_picture(arguments.figure, command, STUDIED_MODULES)
    console.print('  '.join(map(str, files)), highlight=False, soft_wrap=True)
    if arguments.result is not None:
        _keep_rates(rates, made, arguments)
    if arguments.json:
        print_json({'one_in_a_thousand': rates, 'files': files})


def _keep_rates(rates: dict[str, Any], made: str, arguments: argparse.Namespace) -> None:
    """Add the rates of this design to a result file."""
    from ...results import find_stale_entries, load_kept, save_result

    kept = load_kept(arguments.result)
    name, designs = str(arguments.design), kept.get('designs', {})
    stale = not kept or name in find_stale_entries(kept)
    known = {} if stale else designs.get(name, {})
    rates = {kind: known.get(kind, {}) | found for kind, found in rates.items()}
    designs = designs | {name: known | rates}
    commands = dict.fromkeys([*filter(None, kept.get('command', '').split(' && ')), made])
    save_result(
        arguments.result, {'designs': designs}, ' && '.join(commands), STUDIED_MODULES, [name],
        arguments.seed, kept,
    )  # fmt: skip
