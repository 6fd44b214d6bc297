# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem replay`: run a session's commands again and compare with what was recorded.

Without ROS and as fast as it can, through a device of its own; with --ros, into a running node
at the recorded pace. Exit status 0: everything agrees (to the bit on the build that recorded,
else in every decoded level); 1: it does not; 2: the bag cannot be replayed.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from ..clipped import printable

if TYPE_CHECKING:
    from ..bag.replay import Progress, ReplayReport

SUMMARY = 'run a recorded session again and compare, without ROS or into a running node'


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of this sub-command."""
    parser.add_argument('bag', type=Path, help='session bag, or any bag with our command topics')
    parser.add_argument('--node', default='', help='which node of the bag, if there are several')
    parser.add_argument(
        '--preset', default='case_2', help='design for a bag that another recorder wrote'
    )
    parser.add_argument('--ros', metavar='NAME', help='play into the running node of this name')


def run(arguments: argparse.Namespace) -> int:
    """Replay; return the exit status."""
    from ..bag.errors import BagError
    from ..physics import DesignError
    from .console import complain

    try:
        return _into_node(arguments) if arguments.ros else _through_device(arguments)
    except (BagError, DesignError) as error:
        complain('replay', error)
        return 2


def _through_device(arguments: argparse.Namespace) -> int:
    from ..bag.replay import replay, replay_commands
    from ..bag.session_data import load
    from ..device import new_element
    from ..physics import preset

    session = load(arguments.bag, arguments.node)
    with _progress() as progress:
        if session.header is not None:
            report = replay(session, progress)
        else:
            report = replay_commands(new_element(preset(arguments.preset)), session, progress)
    for line in describe(report):
        print(printable(line))
    return 0 if report.passed else 1


def _into_node(arguments: argparse.Namespace) -> int:
    from ..bag.session_data import load
    from ..ros.errors import NoAnswer
    from ..ros.play import play
    from .console import complain

    session = load(arguments.bag, arguments.node)
    recorded = [echo.level for echo in session.echoes]
    try:
        with _progress() as progress:
            heard = play(session, arguments.ros, progress)
    except NoAnswer as error:
        complain('replay', error)
        return 2
    agree = heard[: len(recorded)] == recorded
    print(f'levels recorded {recorded}')
    print(f'levels heard    {heard}')
    print('the levels agree' if agree else 'THE LEVELS DIFFER')
    return 0 if agree else 1


def describe(report: ReplayReport) -> list[str]:
    """Return a report as lines."""
    lines = [
        f'replayed {report.ticks} ticks, {report.commands} commands, '
        f'{len(report.outcomes)} procedures'
    ]
    lines += [f'refused at {refusal}' for refusal in report.refused]
    for name, (then, here) in report.other_build.items():
        lines.append(f'another build: {name} was {then}, is {here}')
    if report.hashes:
        same = 'all equal' if report.difference is None else 'NOT all equal'
        lines.append(f'state hashes  {report.hashes} compared, {same}')
    if report.difference is not None:
        lines.append(
            f'first difference at tick {report.difference.tick}: {report.difference.by:.3g} cells'
        )
    if report.recorded_levels:
        lines.append(
            f'echoes        {len(report.recorded_levels)} recorded, '
            f'greatest difference {report.echo_difference:.3g} cells'
        )
        lines.append(f'levels        {report.levels}')
    if not report.levels_agree:
        lines.append(f'recorded were {report.recorded_levels}')
    if report.exact:
        verdict = 'exact: the same bits' if report.hashes else 'the levels agree'
    else:
        verdict = 'the levels agree' if report.levels_agree else 'THE LEVELS DIFFER'
    return [*lines, verdict if report.passed else f'{verdict}; the replay FAILED']


@contextmanager
def _progress() -> Iterator[Progress]:
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    with Progress(TextColumn('replaying'), BarColumn(), TimeRemainingColumn()) as bar:
        task = bar.add_task('replaying', total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)
