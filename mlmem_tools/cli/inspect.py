# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem inspect`: list what a bag holds and what was lost.

Needs no ROS. Lists topics, commands, procedures and levels. Exit status 0: whole; 1: something is
lost; 2: unreadable.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mlmem.schema import make_printable

from . import laboratory
from .command import JSON_OPTION, declare_command, declare_option
from .output import create_console, print_bag_failure, print_json, print_rows

if TYPE_CHECKING:
    from rich.console import Console

    from mlmem_ros.bag.reader import BagReader


@declare_command(
    'list a session bag, or plot it',
    declare_option('bag', type=Path, help='bag directory or file'),
    declare_option('--node', default='', help='which node of the bag, if there are several'),
    declare_option('--plot', type=Path, metavar='FILE', help='draw the session (.png, .svg)'),
    JSON_OPTION,
    text=__doc__,
)
def inspect(arguments: argparse.Namespace) -> int:
    """Inspect; return the exit status."""
    from mlmem_ros.bag.errors import BagError
    from mlmem_ros.bag.reader import BagReader

    console = create_console(aside=arguments.json)
    try:
        reader = BagReader(arguments.bag)
        found = _list_contents(console, reader) | _inspect_session(console, reader, arguments)
    except BagError as error:
        return print_bag_failure('inspect', error, arguments.json)
    if arguments.json:
        print_json(found)
    return 1 if found['lost'] else 0


def _list_contents(console: Console, reader: BagReader) -> dict[str, Any]:
    """Print the topics of a bag and what was lost; return them."""
    span, lost = reader.span, list(map(str, reader.losses))
    duration = (span[1] - span[0]) / 1e9 if span else 0.0
    topics = {
        name: {'type': info.type, 'messages': info.message_count}
        for name, info in sorted(reader.topics.items())
    }
    head = f'{reader.path}: {reader.message_count} messages, {duration:.2f} s'
    console.print(make_printable(head))
    print_rows(console, 'topics', [{'topic': name, **info} for name, info in topics.items()])
    for each in lost:
        console.print(make_printable(f'lost  {each}'))
    if lost:
        console.print(
            'rosbags and other readers that need a summary refuse a file without its end; '
            'mcap recover FILE -o NEW writes one that they open'
        )
    return {
        'bag': reader.path, 'seconds': duration, 'topics': topics, 'lost': lost,
    }  # fmt: skip


def _inspect_session(
    console: Console, reader: BagReader, arguments: argparse.Namespace
) -> dict[str, Any]:
    """Print what a session holds; return it."""
    from mlmem import Disturb
    from mlmem_ros.session.data import load_session
    from mlmem_ros.session.records import command_to_dict

    from ..describe_command import describe_command

    session = load_session(reader, arguments.node)
    design = session.header.design
    versions = ', '.join(f'{k} {v}' for k, v in session.header.versions.items())
    head = f'{session.node}: {design.levels} levels, {design.N} cells; {versions}'
    console.print(make_printable(head))
    found: dict[str, Any] = {
        'node': session.node,
        'versions': session.header.versions,
        'commands': [{'tick': tick, **command_to_dict(given)} for tick, given in session.stamped],
        'procedures': [{'time': time, **values} for time, values in session.outcomes],
        'unknown': [
            {'time': time, **content.values}
            for time, content in session.events.get('content', [])
            if 'since' in content.values
        ],
        'picture': None,
    }
    commands = [
        {'tick': tick, 'command': describe_command(given, session.content_name)}
        for tick, given in session.stamped
        if not isinstance(given, Disturb)  # there are too many
    ]
    columns = (
        'time', 'procedure', session.content_name, 'code', 'delay', 'confidence', 'attempts',
        'ticks', 'error',
    )  # fmt: skip
    print_rows(console, 'commands', commands)
    print_rows(console, 'procedures', found['procedures'], columns)
    print_rows(console, 'no longer known', found['unknown'])
    if arguments.plot:
        draw = laboratory.load_part('session_figure')
        found['picture'] = draw(reader, arguments.plot, session.node)
        console.print(f'picture  {found["picture"]}')
    return found
