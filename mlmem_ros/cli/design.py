# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem design`: whether a design makes a memory, told before anything is simulated.

`check` takes a ROS parameter file or the name of a preset, judges every quantity that the memory
lives on, and says what goes wrong where one fails. No ROS is needed. Exit status 0: nothing
failed (a warning is no failure); 1: something did; 2: the file cannot be read.
"""

from __future__ import annotations

import argparse
import json
import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..device.checks import Report

SUMMARY = 'judge a design before anything is simulated'

COLOURS = {'pass': 'green', 'warn': 'yellow', 'fail': 'red'}
"""Colours by verdict."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the sub-sub-commands of this sub-command."""
    tasks = parser.add_subparsers(dest='task', required=True, metavar='TASK')
    check = tasks.add_parser('check', help='judge a design', description=__doc__)
    check.add_argument('source', metavar='FILE|PRESET', help='ROS parameter file, or a preset')
    check.add_argument('--json', action='store_true', help='print one JSON object')
    check.add_argument(
        '--brief', action='store_true', help='leave out what passed and where the paper says it'
    )


def run(arguments: argparse.Namespace) -> int:
    """Do the task; return the exit status."""
    from ..device.checks import Verdict, check
    from ..device.errors import SettingsError
    from ..parameter_file import ParameterFileError, load
    from ..physics import DesignError

    try:
        design, settings = load(arguments.source)
    except ParameterFileError as error:
        print(f'mlmem design: {error}', file=sys.stderr)
        return 2
    except (DesignError, SettingsError) as error:
        print(f'mlmem design: {error}', file=sys.stderr)
        return 1
    report = check(design, settings)
    if arguments.json:
        findings = [finding.as_dict() for finding in report.findings]
        print(json.dumps({'verdict': report.verdict.value, 'findings': findings}))
    else:
        _print_report(arguments.source, report, arguments.brief)
    return 1 if report.verdict is Verdict.FAIL else 0


def _print_report(source: str, report: Report, brief: bool) -> None:
    from rich import box
    from rich.console import Console
    from rich.table import Table

    from ..device.checks import Verdict

    console = Console()
    table = Table(title=f'{source}: {report.verdict.value}', show_lines=True, box=box.SIMPLE)
    table.add_column('')
    table.add_column('quantity', no_wrap=True)
    table.add_column('values')
    table.add_column('what it means' + ('' if brief else ', and the paper'))
    for finding in report.findings:
        if brief and finding.verdict is Verdict.PASS:
            continue
        verdict = finding.verdict.value
        name = f'{finding.name}\n[dim]{finding.unit}[/]'
        numbers = '\n'.join(f'{key} {value:.4g}' for key, value in finding.numbers)
        text = finding.text if brief else f'{finding.text}\n[dim]{finding.source}[/]'
        table.add_row(f'[{COLOURS[verdict]}]{verdict}[/]', name, numbers, text)
    if table.row_count:
        console.print(table)
    counts = {verdict: len(report.of(verdict)) for verdict in Verdict}
    console.print(
        f'{len(report.findings)} quantities: {counts[Verdict.FAIL]} failed, '
        f'{counts[Verdict.WARN]} with a warning',
        highlight=False,
    )
