# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem tolerance`: count how often writes and reads fail in imperfect elements.

Elements are made at random, varying one thing at a time: the on-site amplification alpha, the
springs k_r between the cells, the substrate stiffness s, the masses or the ground states (offset)
scatter, the transducers are noisy, the base vibrates (in lattice constants per time unit
squared), or the damping or the gain of the transducers is that of another element. Every step up
is tried, and every level is read from each end that the instrument uses. The study finds the
amounts at which failures begin and counts each until enough have failed; a curve through the
lowest counts shows where one in a thousand fails. The table of all batches, the figure and the
ledger are saved; an interrupted or killed study continues from its ledger. No ROS is needed.
"""

from __future__ import annotations

import argparse
import shutil
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mlmem_tools.cli.command import JSON_OPTION, declare_command, declare_option
from mlmem_tools.cli.output import create_console, create_table, print_failure, print_json

from ..campaign import terminal as campaigns

if TYPE_CHECKING:
    from rich.console import Console

    from ..campaign import Row
    from .study import Tolerance


STUDIED_MODULES = ('mlmem', 'mlmem/physics', 'lab/mlmem_lab/studies/tolerance')

AMOUNT_COUNT = 10

TOLERANCE_OPTIONS = (
    declare_option(
        '--design', default='case_2', metavar='FILE|PRESET', help='element file or preset'
    ),
    declare_option(
        '--kinds',
        nargs='+',
        default=(),
        metavar='KIND',
        help='what is random, one at a time: alpha, k_r, s, mass, offset, noise, vibration, '
        'damping, gain; all by default',
    ),
    declare_option(
        '--tried',
        nargs='+',
        default=(),
        metavar='WHAT',
        help='what is tried: step, left, right (a read from that end), all by default; or kick, '
        'from blank to a level; or, of many walls, word (random ones, by kicks), hear (read) or '
        'blind (both)',
    ),
    declare_option('--amounts', type=int, default=AMOUNT_COUNT, help='amounts per decade'),
    declare_option('--most', type=int, default=3000, help='most trials of an amount'),
    declare_option(
        '--screen',
        action='store_true',
        help='let a forecast choose which steps to simulate, and weight them: for rare failures',
    ),
    declare_option(
        '--levels',
        type=int,
        default=0,
        metavar='N',
        help='try N levels of each element, drawn anew for each; all by default. What spoils one '
        'level may spoil all, so for large elements a few levels of many elements tell more',
    ),
    declare_option('--output', type=Path, default=Path('tolerance'), help='folder'),
    declare_option('--figure', type=Path, metavar='PNG', help='draw the figure here, too'),
    declare_option(
        '--result', type=Path, help='result file; what it has of other designs is kept'
    ),
    *campaigns.CAMPAIGN_OPTIONS,
    JSON_OPTION,
)


@declare_command(
    'measure how much scatter, noise and vibration a memory tolerates',
    *TOLERANCE_OPTIONS,
    text=__doc__,
)
def tolerance(arguments: argparse.Namespace) -> int:
    """Run the study; return 0 when it is done, 1 when it cannot be, 2 for a wrong argument."""
    from mlmem.presets import load_preset

    from ..campaign import CampaignError
    from .element import ALL_KINDS
    from .study import Tolerance

    console = create_console(aside=arguments.json)
    try:
        study = Tolerance(
            *load_preset(arguments.design), tuple(arguments.kinds) or ALL_KINDS,
            tuple(arguments.tried), arguments.amounts, arguments.most, arguments.screen,
            arguments.levels, arguments.seed,
        )  # fmt: skip
        if arguments.point is not None:
            return _run_point(console, study, arguments.point, arguments.json)
        rows = campaigns.evaluate_missing(
            console, study.campaign(), arguments.output / 'ledger.jsonl', arguments.jobs,
            arguments.cluster, what='batches', rows_of=study.count,
        )  # fmt: skip
        _report_rates(console, study, rows, arguments)
    except ValueError as error:
        return print_failure('tolerance', error, 2)
    except (CampaignError, OSError) as error:
        return print_failure('tolerance', error, 1)
    return 0


def _report_rates(
    console: Console, study: Tolerance, rows: list[Row], arguments: argparse.Namespace
) -> None:
    """Save table and figure, and print where one in a thousand fails."""
    from ..campaign import save_table
    from ..style import save_figure, style_context
    from .draw import TRIAL_LABELS, draw_rates
    from .element import WORD_TRIALS

    headings = ('scatter of', *(TRIAL_LABELS[tried] for tried in study.tried))
    table = create_table('scatter at which one in a thousand fails', *headings)
    rare = {
        kind: {tried: study.rare_amount(rows, kind, tried) for tried in study.tried}
        for kind in study.kinds
    }
    for kind, found in rare.items():
        table.add_row(kind, *(text for _, text in found.values()))
    console.print(table)
    files = [save_table(rows, arguments.output / 'batches.csv')]
    with style_context():
        files += save_figure(draw_rates(study, rows), arguments.output / 'tolerance')
    if arguments.figure is not None:
        from ...results import keep_picture

        shutil.copyfile(arguments.output / 'tolerance.png', arguments.figure)
        made = f'mlmem tolerance --design {arguments.design} --most {arguments.most}'
        made += ' --screen' * arguments.screen + f' --figure {arguments.figure}'
        keep_picture(arguments.figure, made, STUDIED_MODULES)
    console.print('  '.join(map(str, files)), highlight=False, soft_wrap=True)
    rates: dict[str, dict[str, dict[str, Any]]] = {
        kind: {tried: {'amount': amount, 'text': text} for tried, (amount, text) in found.items()}
        for kind, found in rare.items()
    }
    for kind, tried in study.curves:
        if tried in WORD_TRIALS:
            rates[kind][tried]['how'] = study.how(rows, kind, tried)
    if arguments.result is not None:
        _keep_rates(rates, arguments)
    if arguments.json:
        print_json({'one_in_a_thousand': rates, 'files': files})


def _keep_rates(rates: dict[str, Any], arguments: argparse.Namespace) -> None:
    """Add the rates of this design to a result file."""
    from ...results import find_stale_entries, load_kept, save_result

    kept = load_kept(arguments.result)
    name, designs = str(arguments.design), kept.get('designs', {})
    stale = not kept or name in find_stale_entries(kept)
    known = {} if stale else designs.get(name, {})
    rates = {kind: known.get(kind, {}) | found for kind, found in rates.items()}
    designs = designs | {name: known | rates}
    tried = ' '.join(('', '--tried', *arguments.tried)) if arguments.tried else ''
    made = f'mlmem tolerance --design {name} --kinds {" ".join(rates)}{tried}'
    made += f' --amounts {arguments.amounts}' if arguments.amounts != AMOUNT_COUNT else ''
    made += f' --most {arguments.most}' + ' --screen' * arguments.screen
    commands = dict.fromkeys([*filter(None, kept.get('command', '').split(' && ')), made])
    made = ' && '.join(commands)
    save_result(
        arguments.result, {'designs': designs}, made, STUDIED_MODULES, [name], arguments.seed, kept
    )


def _run_point(console: Console, study: Tolerance, point: int, as_json: bool) -> int:
    """Make the elements of one batch again and print what each did."""
    from .element import STEP_TRIAL, try_elements

    plan = study.campaign()
    plan.check_point(point)
    values = plan.points[point]
    table = create_table(
        f'batch {point}: {values["kind"]} scatters by {values["scatter"]:g}',
        'seed of the element',
        'step from:to' if values['tried'] == STEP_TRIAL else 'level:read as',
    )
    made = []
    for one in try_elements(plan.common, values, plan.point_seed(point)):
        simulated = one.counts > 0.0
        found = list(zip(one.levels[simulated], one.found[simulated], strict=True))
        table.add_row(str(one.seed), '  '.join(f'{level}:{now}' for level, now in found))
        made.append({'seed': one.seed, 'found': found})
    console.print(table)
    if as_json:
        print_json({'point': point, **values, 'elements': made})
    return 0
