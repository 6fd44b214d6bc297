# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem replay`: run a session's commands again and compare with what was recorded.

Needs no ROS. Exit status 0: nothing is missing, and everything agrees (every bit; on another
build every level, and states within 1e-6 cells); 1: it does not, or there is nothing to compare;
2: the bag cannot be replayed.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING

from mlmem.schema import make_printable

from .command import JSON_OPTION, declare_command, declare_option
from .output import create_console, print_bag_failure, print_json, show_bar

if TYPE_CHECKING:
    from mlmem_ros.session.report import ReplayReport


@declare_command(
    'run a recorded session again without ROS, and compare',
    declare_option('bag', type=Path, help='session bag'),
    declare_option('--node', default='', help='which node of the bag, if there are several'),
    declare_option(
        '--incomplete',
        action='store_true',
        help='accept a recording of which part is missing',
    ),
    JSON_OPTION,
    text=__doc__,
)
def replay(arguments: argparse.Namespace) -> int:
    """Replay; return the exit status."""
    from mlmem_ros.bag.errors import BagError
    from mlmem_ros.session.data import load_session
    from mlmem_ros.session.replay import run_replay

    try:
        session = load_session(arguments.bag, arguments.node)
        with show_bar(create_console(aside=True)) as bar:
            report = run_replay(
                session, lambda done, total: bar('replaying', done / max(1, total))
            )
    except BagError as error:
        return print_bag_failure('replay', error, arguments.json)
    if arguments.json:
        print_json(report.as_dict())
    else:
        for line in describe_report(report):
            print(make_printable(line))
    return 0 if report.passed and (report.whole or arguments.incomplete) else 1


def describe_report(report: ReplayReport) -> list[str]:
    """Return a report as lines: what was run, what was compared, what is missing, the verdict."""
    lines = [f'replayed    {report.ticks} ticks, {report.commands} commands']
    lines += [f'refused     at {refusal}' for refusal in report.refused]
    lines += [f'lost        {loss}' for loss in report.lost]
    for name, (then, here) in report.other_build.items():
        lines.append(f'build       {name} was {then}, is {here}')
    if (states := report.states).compared:
        line = f'states      {states.equal} of {states.compared} equal'
        if states.first_difference is not None:
            line += (
                f'; first difference at tick {states.first_difference}, greatest '
                f'{states.difference:.3g} cells'
            )
        lines.append(line)
    if report.events:
        events = [
            f'~/{name} {each.equal} of {each.recorded}' for name, each in report.events.items()
        ]
        line = f'events      {", ".join(events)} equal'
        if differences := [each.difference for each in report.events.values() if each.difference]:
            line += f'; greatest difference {max(differences):.3g} cells'
        lines.append(line)
    return [*lines, *_format_endings(report), report.verdict]


def _format_endings(report: ReplayReport) -> list[str]:
    """Return a line on how many procedures agree, and a second one on the first that does not."""
    recorded, found = report.recorded_endings, report.endings
    if not recorded:
        return [f'procedures  none recorded; here {_format_values(found) or "none"}']
    pairs = list(zip_longest(recorded, found[: len(recorded)], fillvalue='nothing'))
    line = f'procedures  {sum(then == now for then, now in pairs)} of {len(pairs)} agree'
    if len(found) > len(recorded):
        line += f', {len(found) - len(recorded)} more than recorded'
    lines = [f'{line}: {_format_values([now for _, now in pairs])}']
    for number, (then, now) in enumerate(pairs, start=1):
        if then != now:
            return [*lines, f'            number {number} was {then}, is {now}']
    return lines


def _format_values(values: Sequence[object]) -> str:
    max_listed = 20  # most levels or procedures listed
    more = ', ...' if len(values) > max_listed else ''
    return ', '.join(map(str, values[:max_listed])) + more
