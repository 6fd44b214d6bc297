# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem design`: find a design for a number of levels, judge one, prove one.

`mlmem design --levels 16` finds cells, damping, strain schedule, carrier and threshold by rules
and closed forms; with `--output FILE.yaml` it writes them as a node's parameter file, with
`--prove` it simulates them. Its strokes and its throw, which take a wall down, also follow rules;
`--search TRIALS` looks for better ones (the extra `search`; minutes). No ROS is needed.

`check` takes a ROS parameter file or the name of a preset, judges every quantity that the memory
depends on, and says what goes wrong if one fails. `prove` simulates such designs: every level is
written and read back, lower ones are written, and every level is erased; results are kept, so the
same command continues after a kill.

Exit status 0: nothing failed (warnings do not count); 1: something did; 2: wrong arguments, or a
file that cannot be read.
"""

from __future__ import annotations

import argparse
import dataclasses
import math
from pathlib import Path
from typing import TYPE_CHECKING

from .campaigns import JOBS, evaluated
from .command import JSON, command, option, tasks
from .output import complain, markdown, plain_console, plain_table, print_json

if TYPE_CHECKING:
    from rich.console import Console

    from ..analysis.checks import Report
    from ..device import Settings
    from ..physics import Design


COLOURS = {'pass': 'green', 'warn': 'yellow', 'fail': 'red'}
"""Colours by verdict."""

PROOF = (
    option(
        '--sample', type=int, metavar='N',
        help='downward writes to try; default: all of up to 16 levels, else as many as levels',
    ),
    option('--folder', type=Path, default=Path('proofs'), help='folder for the ledgers'),
    JOBS,
)  # fmt: skip
"""The options of a proof."""


@command(
    'judge a design',
    option('source', metavar='FILE|PRESET', help='ROS parameter file, or a preset'),
    JSON,
    option('--brief', action='store_true', help='leave out passes and quotations of the paper'),
    text='Judge every quantity that the memory depends on, and say what goes wrong if one fails.',
)
def check(arguments: argparse.Namespace) -> int:
    """Judge a design."""
    from ..analysis import checks
    from ..parameter_file import load

    report = checks.check(*load(arguments.source))
    if arguments.json:
        findings = [finding.as_dict() for finding in report.findings]
        print_json({'verdict': report.verdict.value, 'findings': findings})
    else:
        _print_report(plain_console(), arguments.source, report, arguments.brief)
    return 1 if report.verdict is checks.Verdict.FAIL else 0


@command(
    'simulate designs',
    option('sources', metavar='FILE|PRESET', nargs='+', help='ROS parameter files, or presets'),
    option('--markdown', type=Path, metavar='FILE', help='also write the table there'),
    *PROOF,
    JSON,
    text='Write and read back every level, write lower ones, and erase every level.\n'
    'Results are kept, so the same command continues after a kill.',
)
def prove(arguments: argparse.Namespace) -> int:
    """Simulate designs."""
    from ..parameter_file import load

    designs = [(Path(source).stem, *load(source)) for source in arguments.sources]
    return _show(plain_console(aside=arguments.json), designs, arguments, arguments.markdown)


TASKS = {'check': check, 'prove': prove}


@command(
    'find a design for a number of levels, judge one, prove one',
    option('--levels', type=int, metavar='P', help='find a design for 2 to 256 levels'),
    option('--output', type=Path, metavar='FILE.yaml', help='parameter file to write'),
    option(
        '--search',
        type=int,
        default=0,
        metavar='TRIALS',
        help='try this many strokes of either kind, and throws (CMA-ES)',
    ),
    option('--prove', action='store_true', help='simulate the found design'),
    *PROOF,
    JSON,
    tasks(**TASKS),
    text=__doc__,
)
def design(arguments: argparse.Namespace) -> int:
    """Do the task; return the exit status."""
    from ..analysis.designer import DesignNotFound
    from ..device.errors import SettingsError
    from ..parameter_file import ParameterFileError
    from ..physics import DesignError
    from ..studies.campaign import CampaignError

    try:
        return TASKS[arguments.task].run(arguments) if arguments.task else _find(arguments)
    except (ParameterFileError, DesignNotFound) as error:
        return complain('design', error, 2)
    except (DesignError, SettingsError, CampaignError, OSError) as error:
        return complain('design', error, 1)


def _find(arguments: argparse.Namespace) -> int:
    from ..analysis.designer import DesignNotFound, propose, searched
    from ..parameter_file import text_of

    if arguments.levels is None:
        raise DesignNotFound('give --levels P to find a design, or one of check and prove')
    console = plain_console(aside=arguments.json)
    found = propose(arguments.levels)
    how = f'mlmem design --levels {arguments.levels}'
    if arguments.search > 0:
        how += f' --search {arguments.search}'
        try:
            settings = searched(found.design, found.settings, arguments.search)
        except ImportError as error:
            raise DesignNotFound(f'--search needs the extra `search`: {error}') from error
        found = dataclasses.replace(found, settings=settings)
    text = f'# {arguments.levels} levels, by `{how}`.\n' + text_of(found.design, found.settings)
    if arguments.json and not arguments.prove:
        print_json(
            {
                'design': found.design,
                'settings': found.settings,
                'verdict': found.report.verdict.value,
                'file': arguments.output,
            }
        )
    if arguments.output is None:
        print(text, end='', file=console.file)  # and nothing else, so that it can be piped
    else:
        arguments.output.write_text(text, encoding='utf-8')
        console.print(f'written: {arguments.output}')
        for cells, reason in found.reasons.items():
            console.print(f'not {cells} cells per level: {reason}')
        _print_report(console, f'{arguments.levels} levels', found.report, brief=True)
    if not arguments.prove:
        return 0
    name = f'levels_{arguments.levels}'
    return _show(console, [(name, found.design, found.settings)], arguments, None)


def _show(
    console: Console,
    designs: list[tuple[str, Design, Settings]],
    arguments: argparse.Namespace,
    table_file: Path | None,
) -> int:
    """Prove designs and print the table of them; return the exit status."""
    from ..studies.proof import Proof, Tally
    from ..studies.proof_table import cells

    proofs, passed = [], True
    for name, design, settings in designs:
        with console.status(f'{name}: calibrating {design.levels} levels'):
            study = Proof(design, settings, arguments.sample).campaign()
        ledger = arguments.folder / f'{name}.jsonl'
        tally = Tally.of(evaluated(console, study, ledger, arguments.jobs, what=f'{name}: runs'))
        proofs.append(cells(name, design, settings, tally))
        passed = passed and not tally.errors
        for error in tally.errors:
            console.print(f'{name}: {error}', style='red')
    columns = [list(proofs[0]), *(list(proof.values()) for proof in proofs)]
    (_, *names), *lines = zip(*columns, strict=True)
    table = plain_table('', '', *names)
    for line in lines:
        table.add_row(*line)
    console.print(table)
    if arguments.json:
        print_json({'passed': passed, 'proofs': proofs})
    if table_file is not None:
        table_file.write_text(markdown(columns), encoding='utf-8')
    return 0 if passed else 1


def _print_report(console: Console, source: str, report: Report, brief: bool) -> None:
    from rich import box
    from rich.table import Table
    from rich.text import Text

    from ..analysis.checks import Verdict

    table = Table(title=f'{source}: {report.verdict.value}', show_lines=True, box=box.SIMPLE)
    table.add_column('')
    table.add_column('quantity', no_wrap=True)
    table.add_column('values')
    table.add_column('what it means' + ('' if brief else ', and the paper'))
    for finding in report.findings:
        if brief and finding.verdict is Verdict.PASS:
            continue
        verdict = finding.verdict.value
        name = Text.assemble(finding.name, '\n', (finding.unit, 'dim'))
        numbers = '\n'.join(
            f'{key} none' if math.isnan(value) else f'{key} {value:.4g}'
            for key, value in finding.values.items()
        )
        where = () if brief else ('\n', (finding.source, 'dim'))
        text = Text.assemble(finding.text, *where)
        table.add_row(Text(verdict, COLOURS[verdict]), name, numbers, text)
    if table.row_count:
        console.print(table)
    counts = {verdict: len(report.of(verdict)) for verdict in Verdict}
    console.print(
        f'{len(report.findings)} quantities: {counts[Verdict.FAIL]} failed, '
        f'{counts[Verdict.WARN]} with a warning'
    )
