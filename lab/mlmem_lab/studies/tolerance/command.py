# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem tolerance`: count how often writes and reads fail in imperfect elements.

Elements are made at random. The study finds the amounts at which failures begin and counts each
until enough have failed; a curve through the lowest counts shows where one in a thousand fails.
Every curve is saved when it is known; the same command continues after a kill.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from functools import partial
from pathlib import Path

from mlmem_tools.cli.command import JOBS_OPTION, JSON_OPTION, declare_command, declare_option
from mlmem_tools.cli.output import create_console, create_table, print_failure, print_json


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
    declare_option('--most', type=int, default=3000, help='most trials of an amount'),
    declare_option(
        '--output',
        type=Path,
        metavar='JSON',
        help='result file; tolerance/ELEMENT.json by default',
    ),
    declare_option('--figure', type=Path, metavar='PNG', help='draw the figure here'),
    JOBS_OPTION,
    JSON_OPTION,
    text=__doc__,
)
def tolerance(arguments: argparse.Namespace) -> int:
    """Run the study; return 0 when it is done, 1 when it cannot be, 2 for a wrong argument."""
    from ...results import load_kept, load_result
    from .draw import draw_rates
    from .element import ALL_KINDS, TRIAL_LABELS
    from .study import list_cases, tolerance_study

    console = create_console(aside=arguments.json)
    kinds, trials = arguments.kinds or ALL_KINDS, arguments.tried or ('step', 'left', 'right')
    try:
        cases = list_cases(arguments.design, kinds, trials, arguments.most)
    except ValueError as error:
        return print_failure('tolerance', error, 2)
    element = Path(arguments.design)
    own_file = [str(element.resolve())] if element.exists() else []
    file = arguments.output or Path('tolerance', f'{element.stem}.json')
    try:
        study = replace(
            tolerance_study,
            cases=tuple(dict.fromkeys([*load_kept(file).get('cases', {}), *cases])),
            modules=(*tolerance_study.modules, *own_file),
            file=file,
            draw=partial(draw_rates, cases=cases),
        )
        missing = set(study.list_missing())
        study.measure_cases(console, arguments.jobs, [case for case in cases if case in missing])
        found = load_result(file)['cases']
        if arguments.figure is not None:
            study.draw_picture(arguments.figure)
    except (ValueError, OSError) as error:
        return print_failure('tolerance', error, 1)
    headings = ('scatter of', *(TRIAL_LABELS[tried] for tried in trials))
    table = create_table('scatter at which one in a thousand fails', *headings)
    for kind in kinds:
        own = (case for case in cases if case.split()[-3] == kind)
        table.add_row(kind, *(found[case]['text'] for case in own))
    console.print(table)
    console.print(str(file), highlight=False, soft_wrap=True)
    if arguments.json:
        rates = {case: {key: found[case][key] for key in ('amount', 'text')} for case in cases}
        print_json({'one_in_a_thousand': rates, 'file': file})
    return 0
