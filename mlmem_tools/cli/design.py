# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem design`: find, check and prove designs.

`--levels 8` searches an element that kicks write and whose parts may scatter by `--scatter` and
rub by `--friction`, and rejects what is impossible. All but `check` needs the laboratory.

Exit status 0: nothing failed (warnings do not count); 1: something did; 2: wrong arguments, or a
file that cannot be read.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from . import laboratory
from .command import (
    JOBS_OPTION,
    JSON_OPTION,
    declare_command,
    declare_option,
    declare_tasks,
    load_judged_element,
)
from .output import create_console, print_failure, print_json, print_rows

if TYPE_CHECKING:
    from ..checks import Report


PROOF_OPTIONS = (
    declare_option(
        '--sample', type=int, metavar='N',
        help='downward writes to try; default: all of up to 16 levels, else as many as levels',
    ),
    JOBS_OPTION,
)  # fmt: skip
"""The options of a proof."""


@declare_command(
    'judge a design',
    declare_option('source', metavar='ELEMENT', help='shipped element, or element file'),
    JSON_OPTION,
    declare_option('--brief', action='store_true', help='leave out passes'),
    text='Judge every quantity that the memory depends on, say what goes wrong if one fails.',
)
def check(arguments: argparse.Namespace) -> int:
    """Judge a design."""
    from .. import checks

    element, individual = load_judged_element(arguments.source)
    report = checks.check(element.design, element.settings, individual)
    if arguments.json:
        print_json({'verdict': report.verdict, 'findings': report.findings})
    else:
        console = create_console()
        shown = [
            row for row in _list_rows(report) if not arguments.brief or row['verdict'] != 'pass'
        ]
        print_rows(console, f'{arguments.source}: {report.verdict.value}', shown)
        console.print(
            f'{len(report.findings)} quantities: {len(report.of(checks.Verdict.FAIL))} failed, '
            f'{len(report.of(checks.Verdict.WARN))} with a warning'
        )
    return 1 if report.verdict is checks.Verdict.FAIL else 0


@declare_command(
    'simulate designs',
    declare_option(
        'sources', metavar='ELEMENT', nargs='+', help='shipped elements, or element files'
    ),
    *PROOF_OPTIONS,
    JSON_OPTION,
    text='Write and read back every level, write lower ones, and erase every level.',
)
def prove(arguments: argparse.Namespace) -> int:
    """Simulate designs."""
    return int(laboratory.load_part('prove_designs')(arguments))


@declare_command(
    'find, check and prove designs',
    declare_option('--levels', type=int, metavar='P', help='find an element of 2 to 256 levels'),
    declare_option(
        '--scatter',
        type=float,
        default=0.03,
        metavar='SIGMA',
        help='standard deviation of on-site stiffness, springs and masses, relative',
    ),
    declare_option(
        '--friction',
        type=float,
        default=0.0,
        metavar='F',
        help='dry friction of every cell in k_r times lattice constants',
    ),
    declare_option('--trials', type=int, default=100, metavar='N', help='elements to try'),
    declare_option(
        '--output', type=Path, metavar='FILE.yaml', help='element file to write; none: print it'
    ),
    declare_option('--prove', action='store_true', help='simulate the found element'),
    *PROOF_OPTIONS,
    JSON_OPTION,
    declare_tasks(check=check, prove=prove),
    text=__doc__,
)
def design(arguments: argparse.Namespace) -> int:
    """Do the task; return the exit status."""
    from mlmem.errors import SettingsError
    from mlmem.parsing import DecodeError
    from mlmem.physics import DesignError, StateError

    if not arguments.task and (error := _reject_request(arguments)):
        return print_failure('design', error, 2)
    try:
        if arguments.task:
            return (check if arguments.task == 'check' else prove).run(arguments)
        return int(laboratory.load_part('find_design')(arguments))
    except DecodeError as error:
        return print_failure('design', error, 2)
    except (DesignError, SettingsError, StateError, OSError) as error:
        return print_failure('design', error, 1)


def _reject_request(arguments: argparse.Namespace) -> str:
    """Print the budget of a requested element; return why there is none, or an empty text."""
    from ..checks import Verdict
    from ..checks.budget import judge_request

    levels, scatter, friction = arguments.levels, arguments.scatter, arguments.friction
    if levels is None:
        return 'give --levels P, or one of check and prove'
    if not 2 <= levels <= 256:
        return f'--levels must be from 2 to 256; got {levels}'
    if not (0.0 < scatter <= 0.3 and 0.0 <= friction <= 0.1 and arguments.trials >= 1):
        return (
            '--scatter must be above 0 and at most 0.3, --friction from 0 to 0.1, --trials at '
            f'least 1; got {scatter:g}, {friction:g}, {arguments.trials}'
        )
    report = judge_request(levels, scatter, friction)
    title = f'{levels} levels, scatter {scatter:g}, friction {friction:g}'
    aside = arguments.json or arguments.output is None  # the element may be piped
    print_rows(create_console(aside=aside), f'budget of {title}', _list_rows(report))
    return '; '.join(finding.text for finding in report.of(Verdict.FAIL))


def _list_rows(report: Report) -> list[dict[str, str]]:
    """Return the findings as rows of a table."""
    return [
        {
            'verdict': finding.verdict.value,
            'quantity': f'{finding.name} {finding.unit}'.rstrip(),
            'values': ', '.join(f'{key} {value:.4g}' for key, value in finding.values.items()),
            'what it means': finding.text,
        }
        for finding in report.findings
    ]
