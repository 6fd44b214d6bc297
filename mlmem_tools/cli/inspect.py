# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem inspect`: list what a bag holds and what was lost.

Needs no ROS. Lists topics, commands, procedures and levels. Exit status 0: whole; 1: something is
lost; 2: unreadable.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mlmem.procedure_table import describe_content
from mlmem.schema import make_printable

from . import laboratory
from .command import JSON_OPTION, declare_command, declare_option
from .output import create_console, create_table, print_bag_failure, print_json

if TYPE_CHECKING:
    from rich.console import Console

    from mlmem import Command
    from mlmem_ros.bag.contents import Loss
    from mlmem_ros.bag.reader import BagReader
    from mlmem_ros.session.data import SessionData


@declare_command(
    'list a session bag, plot or repair it',
    declare_option('bag', type=Path, help='bag directory or file'),
    declare_option('--node', default='', help='which node of the bag, if there are several'),
    declare_option('--plot', type=Path, metavar='FILE', help='draw the session (.png, .svg)'),
    declare_option(
        '--repair', type=Path, metavar='NEW', help='write an intact bag of everything readable'
    ),
    JSON_OPTION,
    text=__doc__,
)
def inspect(arguments: argparse.Namespace) -> int:
    """Inspect; return the exit status."""
    from mlmem_ros.bag.errors import BagError
    from mlmem_ros.bag.reader import BagReader

    console = create_console(aside=arguments.json)
    try:
        if arguments.repair:
            found, whole = _repair_bag(console, arguments.bag, arguments.repair), True
        else:
            reader = BagReader(arguments.bag)
            found = _list_contents(console, reader) | _inspect_session(console, reader, arguments)
            whole = not found['lost']
    except BagError as error:
        return print_bag_failure('inspect', error, arguments.json)
    if arguments.json:
        print_json(found)
    return 0 if whole else 1


def _repair_bag(console: Console, source: Path, destination: Path) -> dict[str, Any]:
    from .repair import repair_bag

    report = repair_bag(source, destination)
    lost = _list_losses(console, report.losses)
    console.print(f'{report.messages} messages saved in {report.destination}')
    return {'saved': report.messages, 'bag': report.destination, 'lost': lost}


def _list_losses(console: Console, losses: Sequence[Loss]) -> list[str]:
    from rich.text import Text

    for loss in losses:
        console.print(Text('lost  ', 'yellow'), make_printable(str(loss)), sep='')
    return list(map(str, losses))


def _list_contents(console: Console, reader: BagReader) -> dict[str, Any]:
    span = reader.span
    duration = (span[1] - span[0]) / 1e9 if span else 0.0
    console.print(
        f'{make_printable(str(reader.path))}: {reader.message_count} messages, {duration:.2f} s'
    )
    table = create_table('topics', 'topic', 'type', '>messages')
    for name, info in sorted(reader.topics.items()):
        _add_row(table, name, info.type, str(info.message_count))
    console.print(table)
    for key, value in reader.custom_data.items():
        console.print(make_printable(f'{key}: {value}'))
    if lost := _list_losses(console, reader.losses):
        console.print(
            'rosbags and other readers that need a summary refuse this bag as it is; mlmem '
            'inspect BAG --repair NEW writes one that they open'
        )
    return {
        'bag': reader.path,
        'seconds': duration,
        'topics': {
            name: {'type': info.type, 'messages': info.message_count}
            for name, info in sorted(reader.topics.items())
        },
        'custom_data': reader.custom_data,
        'lost': lost,
    }


def _inspect_session(
    console: Console, reader: BagReader, arguments: argparse.Namespace
) -> dict[str, Any]:

    from mlmem_ros.session.data import load_session
    from mlmem_ros.session.records import command_to_dict

    session = load_session(reader, arguments.node, motion=bool(arguments.plot))
    if session.header is None:
        console.print(
            f'{make_printable(session.node)}: written by another recorder, no session header'
        )
    else:
        design = session.design
        versions = ', '.join(f'{k} {v}' for k, v in session.header.versions.items())
        console.print(
            make_printable(f'{session.node}: {design.levels} levels, {design.N} cells; {versions}')
        )
    _list_commands(console, session)
    _list_procedures(console, session)
    _list_unknown(console, session)
    echoes = _list_echoes(console, session)
    picture = None
    if arguments.plot:
        picture = laboratory.load_part(laboratory.PICTURE_PART)(session, arguments.plot)
        console.print(f'picture  {picture}')
    return {
        'node': session.node,
        'versions': session.header.versions if session.header else None,
        'commands': [{'tick': tick, **command_to_dict(given)} for tick, given in session.stamped]
        or [{'time': time, **command_to_dict(given)} for time, given in session.commands],
        'procedures': [{'time': time, **values} for time, values in session.outcomes],
        'unknown': [
            {'time': time, **values} for time, _, values in session.contents if 'since' in values
        ],
        'echoes': echoes,
        'picture': picture,
    }


def _list_commands(console: Console, session: SessionData) -> None:
    from mlmem import Disturb

    if session.stamped:
        head = 'commands', '>tick', 'command'
        rows = [(str(tick), command) for tick, command in session.stamped]
    else:
        head = 'command messages', '>time', 'command'
        rows = [(f'{seconds:.3f} s', command) for seconds, command in session.commands]
    if rows:
        table = create_table(*head)
        for when, command in rows:
            if not isinstance(command, Disturb):
                _add_row(table, when, _describe_command(command, session.content_name))
        console.print(table)
    shakes = [command.acceleration for _, command in rows if isinstance(command, Disturb)]
    if shakes:  # too many for a table
        largest = max(shakes, key=abs)
        console.print(f'disturbances {len(shakes)}, the largest {largest:.3g}')


def _describe_command(command: Command, content_name: str) -> str:
    """Return a command in words, with active faults only."""
    from mlmem import SetFaults, Write

    if isinstance(command, Write) and content_name == 'word':
        return f'Write({describe_content(content_name, command.level)})'
    if isinstance(command, SetFaults):
        return f'SetFaults({command.faults.list_active() or "healthy"})'
    return str(command)


def _list_procedures(console: Console, session: SessionData) -> None:
    if not session.outcomes:
        return

    table = create_table(
        'procedures',
        '>time', 'procedure', f'>{session.content_name}', 'code', '>delay', '>margins', '>tries',
        '>ticks', 'error',
    )  # fmt: skip
    for seconds, values in session.outcomes:
        margins = [
            _round_text(values.get(f'{kind}_margin', '')) for kind in ('level', 'threshold')
        ]
        _add_row(
            table,
            f'{seconds:.3f} s',
            values.get('procedure', ''),
            values.get(session.content_name, ''),
            values.get('code', ''),
            _round_text(values.get('delay', '')),
            ' '.join(margins),
            values.get('attempts', ''),
            values.get('ticks', ''),
            values.get('error', ''),
        )
    console.print(table)


def _list_unknown(console: Console, session: SessionData) -> None:
    """List when the content was no longer known, and why."""
    table = create_table('content', '>time', 'what')
    for seconds, text, values in session.contents:
        if 'since' in values:
            _add_row(table, f'{seconds:.3f} s', text)
    if table.row_count:
        console.print(table)


def _round_text(text: str) -> str:
    try:
        return f'{float(text):.2f}'
    except ValueError:
        return text


def _list_echoes(console: Console, session: SessionData) -> list[dict[str, Any]]:
    """List the content that was published with every echo."""
    name = session.content_name
    table = create_table('echoes', '>time', f'>{name}')
    for echo in session.echoes:
        known = f'no {name}' if echo.content is None else describe_content(name, echo.content)
        table.add_row(f'{echo.time:.3f} s', known)
    if session.echoes:
        console.print(table)
    return [{'time': echo.time, name: echo.content} for echo in session.echoes]


def _add_row(table: Any, *cells: str) -> None:
    """Add a row of texts from the file."""
    table.add_row(*(make_printable(cell, 300) for cell in cells))
