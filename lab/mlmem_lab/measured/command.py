# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem measured`: predict transition waves measured in a real lattice of bistable shells.

Nine lattices (three distances of the rails, three spacings of the elements). What slows the
elements is fitted to the speeds at 8 cm; all other speeds are predictions. Random chains give
bands. With --output the figures and a result file are written.

--curves takes the laws of the shells from force tests instead of the authors' polynomials, and all
that is not known as distributions. It tells the evidence for what slows the elements. Lattices are
predicted from the curves alone, and with their data; with --left-out from the data of the others.
Minutes.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from mlmem_tools.cli.command import JSON_OPTION, declare_command, declare_option
from mlmem_tools.cli.output import create_console, create_table, print_failure, print_json

from .fits import pattern_probability
from .posterior import PARTICLES

if TYPE_CHECKING:
    from rich.console import Console

    from .study import Study


STUDIED_MODULES = ('mlmem/physics', 'lab/mlmem_lab/lattices', 'lab/mlmem_lab/measured')

KNOWLEDGE_KINDS = {'curves': 'curves alone', 'unseen': 'left out', 'seen': 'with its data'}
"""What is known of a lattice that is predicted."""


@declare_command(
    'predict the speeds of transition waves measured in a real lattice',
    declare_option('--chains', type=int, default=40, help='random chains a lattice; 0: no bands'),
    declare_option(
        '--full',
        action='store_true',
        help='also: fronts at 6 cm, cases left out, and what would silence a lattice; minutes',
    ),
    declare_option('--curves', action='store_true', help='from force curves, by a posterior'),
    declare_option(
        '--left-out', action='store_true', help='with --curves: each lattice from the others'
    ),
    declare_option('--particles', type=int, default=PARTICLES, help='draws of that posterior'),
    declare_option('--seed', type=int, default=1, help='of random numbers'),
    declare_option('--output', type=Path, help='folder for figures and result file'),
    JSON_OPTION,
    text=__doc__,
)
def measured(arguments: argparse.Namespace) -> int:
    """Predict; return 0, 1 when a file could not be written, 2 for a wrong argument."""
    from ..results import keep_picture, save_result
    from .runs import DATA_ATTRIBUTION
    from .study import build_study, draw_all

    if arguments.chains < 0 or arguments.seed < 0:
        return print_failure('measured', '--chains and --seed must be at least 0', 2)
    if not 10 <= arguments.particles <= 100_000:
        return print_failure('measured', '--particles must be from 10 to 100000', 2)
    folder = arguments.output
    try:
        if folder is not None:
            folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        return print_failure('measured', f'--output must be a writable folder; {error}', 2)
    console = create_console(aside=arguments.json)
    if arguments.curves:
        return _predict_from_curves(arguments, console)
    study = build_study(arguments.chains, arguments.seed, arguments.full)
    _print_study(console, study)
    console.print(DATA_ATTRIBUTION)
    if folder is not None:
        made = f'mlmem measured --chains {study.chains} --seed {study.seed}'
        made += ' --full' if arguments.full else ''
        result = {'attribution': DATA_ATTRIBUTION, **study.as_dict()}
        try:
            file = save_result(
                folder / 'measured.json', result, made, STUDIED_MODULES, seed=study.seed
            )
            files = [file, *draw_all(study, folder)]
            for picture in files[1:]:
                keep_picture(picture, f'{made} --output {folder}', STUDIED_MODULES)
        except OSError as error:
            return print_failure('measured', f'a file could not be written; {error}', 1)
        console.print('  '.join(map(str, files)), soft_wrap=True)
    if arguments.json:
        print_json(study.as_dict())
    return 0


def _predict_from_curves(arguments: argparse.Namespace, console: Console) -> int:
    """Predict from force curves; return the exit status."""
    from ..results import save_result
    from .curves import predict_studied, predict_unseen
    from .runs import DATA_ATTRIBUTION

    study, name = (predict_unseen, 'unseen') if arguments.left_out else (predict_studied, 'curves')
    with console.status('') as status:
        result = study(
            arguments.particles, arguments.seed,
            lambda what, done: status.update(f'{what}: {done:.0%}'),
        )  # fmt: skip
    looks = [look for look in ('curves', 'unseen', 'seen') if look in result['cases'][0]]
    table = create_table(
        'Speeds in m/s, middle nine tenths; share in which no wave passes', '>rail', '>spacing',
        '>measured', *(f'>{KNOWLEDGE_KINDS[look]}' for look in looks),
    )  # fmt: skip
    for row in result['cases']:
        seen = row['measured']
        table.add_row(
            f'{row["rail"]:g}', f'{row["spacing"]}',
            'none' if seen is None else ' '.join(f'{each:.2f}' for each in seen),
            *(_format_band(row[look]) for look in looks),
        )  # fmt: skip
    console.print(table)
    for losses, evidence in result.get('evidence', {}).items():
        console.print(f'evidence of {losses}: exp({evidence:.1f})')
    console.print(DATA_ATTRIBUTION)
    if arguments.output is not None:
        made = (
            f'mlmem measured --curves --particles {arguments.particles} --seed {arguments.seed}'
            + ' --left-out' * arguments.left_out
        )
        try:
            said = {'attribution': DATA_ATTRIBUTION, **result}
            file = arguments.output / f'{name}.json'
            save_result(file, said, made, STUDIED_MODULES, seed=arguments.seed)
        except OSError as error:
            return print_failure('measured', f'a file could not be written; {error}', 1)
        console.print(str(file), soft_wrap=True)
    if arguments.json:
        print_json(result)
    return 0


def _format_band(given: Mapping[str, float | None]) -> str:
    if given['median'] is None:
        return 'none'
    text = f'{given["median"]:.2f} ({given["low"]:.2f} to {given["high"]:.2f})'
    return f'{text}, none {given["silent"]:.0%}' if given['silent'] else text


def _print_study(console: Console, study: Study) -> None:
    table = create_table(
        'Speeds in m/s; bands: nine of ten random chains', '>rail', '>spacing', '>measured',
        '>predicted', '>band', '>stops', 'this lattice was', '>viscous', '>authors',
    )  # fmt: skip
    for row in study.rows:
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
            f'{pattern_probability(by_case):.1g}; waves that stop: {silent or "none"}'
        )
