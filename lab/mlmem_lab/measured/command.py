# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem measured`: predict transition waves measured in a real lattice of bistable shells.

Nine lattices (three distances of the rails, three spacings of the elements). What slows the
elements is fitted to the speeds at 8 cm; all other speeds are predictions. Random chains give
bands. With --output the figures and a result file are written.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from mlmem_tools.cli.command import JSON, command, option
from mlmem_tools.cli.output import complain, plain_console, plain_table, print_json

from .scatter import pattern

if TYPE_CHECKING:
    from rich.console import Console

    from .study import Study


@command(
    'predict the speeds of transition waves measured in a real lattice',
    option('--chains', type=int, default=40, help='random chains a lattice; 0: no bands'),
    option(
        '--full',
        action='store_true',
        help='also: fronts at 6 cm, cases left out, and what would silence a lattice; minutes',
    ),
    option('--seed', type=int, default=1, help='of the random chains'),
    option('--output', type=Path, help='folder for figures and result file'),
    JSON,
    text=__doc__,
)
def measured(arguments: argparse.Namespace) -> int:
    """Predict; return 0, 1 when a file could not be written, 2 for a wrong argument."""
    from ..results import LATTICE, by, keep_picture, save
    from .draw import draw_all
    from .runs import ATTRIBUTION
    from .study import studied

    if arguments.chains < 0 or arguments.seed < 0:
        return complain('measured', '--chains and --seed must be at least 0', 2)
    folder = arguments.output
    try:
        if folder is not None:
            folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        return complain('measured', f'--output must be a writable folder; {error}', 2)
    console = plain_console(aside=arguments.json)
    study = studied(arguments.chains, arguments.seed, arguments.full)
    _print(console, study)
    console.print(ATTRIBUTION)
    if folder is not None:
        made = f'mlmem measured --chains {study.chains} --seed {study.seed}'
        made += ' --full' if arguments.full else ''
        of = [LATTICE, *by(studied, 'study')]
        result = {'attribution': ATTRIBUTION, **study.as_dict()}
        try:
            file = save(folder / 'measured.json', result, made, study.seed, of)
            files = [file, *draw_all(study, folder)]
            for picture in files[1:]:
                keep_picture(picture, f'{made} --output {folder}', [*of, *by(draw_all, 'picture')])
        except OSError as error:
            return complain('measured', f'a file could not be written; {error}', 1)
        console.print('  '.join(map(str, files)), soft_wrap=True)
    if arguments.json:
        print_json(study.as_dict())
    return 0


def _print(console: Console, study: Study) -> None:
    table = plain_table(
        'Speeds in m/s; bands: nine of ten random chains', '>rail', '>spacing', '>measured',
        '>predicted', '>band', '>stops', 'this lattice was', '>viscous', '>authors',
    )  # fmt: skip
    for row in study.rows():
        seen, low = row['measured'], row['low']
        table.add_row(
            f'{row["rail"]:g}', f'{row["spacing"]}',
            'none' if seen is None else ' '.join(f'{each:.2f}' for each in seen),
            'none' if row['speed'] is None else f'{row["speed"]:.2f}',
            '' if low is None else f'{low:.2f} to {row["high"]:.2f}',
            '' if low is None else f'{row["stops"]:.0%}',
            'fitted' if row['fitted'] else 'not seen',
            'none' if row['viscous'] is None else f'{row["viscous"]:.2f}',
            f'{row["authors"]:.2f}',
        )  # fmt: skip
    console.print(table)
    losses = study.steady.losses[22.5]
    console.print(
        f'damping {losses.damping:.4f} per ms, dry friction {10.0 * losses.friction:.3f} N'
    )
    for force, by_case in study.stops.items():
        silent = ', '.join(f'{case} {share:.0%}' for case, share in by_case.items() if share)
        console.print(
            f'force on each element {10.0 * force:.3f} N: what was seen has a probability of '
            f'{pattern(by_case):.1g}; waves that stop: {silent or "none"}'
        )
