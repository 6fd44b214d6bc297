# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem measured`: predict transition waves measured in a real lattice of bistable shells.

Nine lattices (three distances of the rails, three spacings of the elements). The laws of the
shells come from force tests; all that is not known is drawn from distributions. Lattices are
predicted from the force tests alone, and with their data, together with the evidence for what
slows the elements; with --left-out each lattice is predicted from the data of the others. Minutes.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path

from mlmem_tools.cli.command import JSON_OPTION, declare_command, declare_option
from mlmem_tools.cli.output import create_console, create_table, print_failure, print_json

from .posterior import PARTICLES

STUDIED_MODULES = ('mlmem/physics', 'lab/mlmem_lab/lattices', 'lab/mlmem_lab/measured')

KNOWLEDGE_KINDS = {'curves': 'curves alone', 'unseen': 'left out', 'seen': 'with its data'}
"""What is known of a lattice that is predicted."""


@declare_command(
    'predict the speeds of transition waves measured in a real lattice',
    declare_option('--left-out', action='store_true', help='each lattice from the others'),
    declare_option('--particles', type=int, default=PARTICLES, help='draws of the posterior'),
    declare_option('--seed', type=int, default=1, help='of random numbers'),
    declare_option('--output', type=Path, help='folder for the result file'),
    JSON_OPTION,
    text=__doc__,
)
def measured(arguments: argparse.Namespace) -> int:
    """Predict; return 0, 1 when a file could not be written, 2 for a wrong argument."""
    from ..results import save_result
    from .curves import predict_studied, predict_unseen
    from .runs import DATA_ATTRIBUTION

    if arguments.seed < 0:
        return print_failure('measured', '--seed must be at least 0', 2)
    if not 10 <= arguments.particles <= 100_000:
        return print_failure('measured', '--particles must be from 10 to 100000', 2)
    console = create_console(aside=arguments.json)
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
        made = f'mlmem measured --particles {arguments.particles} --seed {arguments.seed}'
        made += ' --left-out' * arguments.left_out
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
