# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem design`: find, check and prove designs.

`--levels 16` finds a design by rules and closed forms. `--law LAW.yaml` says whether cells with a
law of their own can be a memory, with which gradient, and, without `--levels`, of how many levels.
`--levels 8 --scatter 0.03` searches an element for uneven parts, which kicks alone write, and
rejects what is impossible. All but `check` needs the laboratory.

Exit status 0: nothing failed (warnings do not count); 1: something did; 2: wrong arguments, or a
file that cannot be read.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from . import laboratory
from .command import (
    ELEMENT_OPTION,
    JOBS_OPTION,
    JSON_OPTION,
    declare_command,
    declare_option,
    declare_tasks,
    load_element_option,
)
from .output import create_console, print_failure, print_json, print_rows

if TYPE_CHECKING:
    from rich.console import Console

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
    ELEMENT_OPTION,
    JSON_OPTION,
    declare_option('--brief', action='store_true', help='leave out passes'),
    text='Judge every quantity that the memory depends on, say what goes wrong if one fails.',
)
def check(arguments: argparse.Namespace) -> int:
    """Judge a design."""
    from mlmem import load_element

    from .. import checks

    design, settings = load_element(arguments.source).design_and_settings
    report = checks.check(design, settings, load_element_option(arguments, design, settings))
    failed = report.verdict is checks.Verdict.FAIL
    if arguments.json:
        findings = [finding.as_dict() for finding in report.findings]
        print_json({'verdict': report.verdict.value, 'findings': findings})
    else:
        print_report(create_console(), arguments.source, report, arguments.brief)
    return 1 if failed else 0


@declare_command(
    'simulate designs',
    declare_option(
        'sources', metavar='ELEMENT', nargs='+', help='shipped elements, or element files'
    ),
    ELEMENT_OPTION,
    *PROOF_OPTIONS,
    JSON_OPTION,
    text='Write and read back every level, write lower ones, and erase every level.',
)
def prove(arguments: argparse.Namespace) -> int:
    """Simulate designs."""
    if arguments.element is not None and len(arguments.sources) > 1:
        return print_failure('design', '--element needs the one design that it is of', 2)
    done: int = laboratory.load_part('prove_designs')(arguments)
    return done


DESIGN_TASKS = {'check': check, 'prove': prove}


@declare_command(
    'find, check and prove designs',
    declare_option('--levels', type=int, metavar='P', help='find a design for 2 to 256 levels'),
    declare_option(
        '--scatter',
        type=float,
        metavar='SIGMA',
        help='search cells whose on-site stiffness, springs and masses scatter by this standard '
        'deviation, relative',
    ),
    declare_option(
        '--friction',
        type=float,
        default=0.0,
        metavar='F',
        help='with --scatter: dry friction of every cell in k_r times lattice constants',
    ),
    declare_option(
        '--trials', type=int, default=500, metavar='N', help='with --scatter: designs to try'
    ),
    declare_option('--law', type=Path, metavar='LAW.yaml', help='on-site law of the cells'),
    declare_option(
        '--phase', type=int, default=0, help='ground state of the law that is blank, from 0'
    ),
    declare_option('--length', type=float, metavar='M', help='its lattice constant'),
    declare_option('--spring', type=float, metavar='N/M', help='its springs between cells'),
    declare_option('--mass', type=float, metavar='KG', help='its masses'),
    declare_option('--output', type=Path, metavar='FILE.yaml', help='element file to write'),
    declare_option('--prove', action='store_true', help='simulate the found design'),
    *PROOF_OPTIONS,
    JSON_OPTION,
    declare_tasks(**DESIGN_TASKS),
    text=__doc__,
)
def design(arguments: argparse.Namespace) -> int:
    """Do the task; return the exit status."""
    from mlmem.errors import SettingsError
    from mlmem.parsing import DecodeError
    from mlmem.physics import DesignError, StateError

    if not arguments.task and arguments.levels is None and arguments.law is None:
        return print_failure(
            'design', 'give --levels P or --law FILE, or one of check and prove', 2
        )
    of_a_law = arguments.length, arguments.spring, arguments.mass
    if any((each is None) == (arguments.law is not None) for each in of_a_law):
        return print_failure('design', '--law, --length, --spring and --mass need each other', 2)
    if arguments.scatter is not None and (error := _reject_request(arguments)):
        return print_failure('design', error, 2)
    try:
        if arguments.task:
            return DESIGN_TASKS[arguments.task].run(arguments)
        found: int = laboratory.load_part('find_design')(arguments)
        return found
    except DecodeError as error:
        return print_failure('design', error, 2)
    except (DesignError, SettingsError, StateError, OSError) as error:
        return print_failure('design', error, 1)


def _reject_request(arguments: argparse.Namespace) -> str:
    """Print the budget of a robust element; return why there is none, or an empty text."""
    from ..checks import Verdict
    from ..checks.budget import judge_request

    levels, scatter, friction = arguments.levels, arguments.scatter, arguments.friction
    if arguments.law is not None or levels is None or not 2 <= levels <= 256:
        return f'--scatter needs --levels from 2 to 256, and no --law; got {levels}'
    if not (0.0 < scatter <= 0.3 and 0.0 <= friction <= 0.1 and arguments.trials >= 1):
        return (
            '--scatter must be above 0 and at most 0.3, --friction from 0 to 0.1, --trials at '
            f'least 1; got {scatter:g}, {friction:g}, {arguments.trials}'
        )
    report = judge_request(levels, scatter, friction)
    title = f'{levels} levels, scatter {scatter:g}, friction {friction:g}'
    print_rows(create_console(aside=arguments.json), f'budget of {title}', _list_rows(report))
    return '; '.join(finding.text for finding in report.of(Verdict.FAIL))


def print_report(console: Console, source: str, report: Report, brief: bool) -> None:
    """Print the findings of a check in a table, without passes if `brief`."""
    from ..checks import Verdict

    shown = [row for row in _list_rows(report) if not (brief and row['verdict'] == 'pass')]
    print_rows(console, f'{source}: {report.verdict.value}', shown)
    counts = {verdict: len(report.of(verdict)) for verdict in Verdict}
    console.print(
        f'{len(report.findings)} quantities: {counts[Verdict.FAIL]} failed, '
        f'{counts[Verdict.WARN]} with a warning'
    )


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
