# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The commands that make one request to a running node, and print its answer."""

from __future__ import annotations

import argparse
import dataclasses
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeVar

from ..words import describe_level
from .command import JSON, NODE, command, one_of, option, wait
from .console import complain
from .output import print_json

if TYPE_CHECKING:
    from ..contract.answers import Answer, Calibrated, Decoded, Done, Recorded, SelfTested
    from ..ros.client.client import MemoryClient
    from ..ros.client.reply import Reply

SomeAnswer = TypeVar('SomeAnswer', bound='Answer')

REQUEST = (NODE, wait(5.0), JSON)
"""The options of every request."""


@command(
    'write a level into the element behind a running node',
    option('level', type=int, help='level to write, from 0'),
    *REQUEST,
    text='Write a level into the element behind a running node.',
)
def write(arguments: argparse.Namespace) -> int:
    """Write a level."""
    return _ask(arguments, lambda client: client.write(arguments.level), _decoded)


@command(
    'read the level of the element behind a running node',
    *REQUEST,
    text='Read the level of the element behind a running node.',
)
def read(arguments: argparse.Namespace) -> int:
    """Read the level."""
    return _ask(arguments, lambda client: client.read(), _decoded)


@command(
    'make the element behind a running node blank',
    *REQUEST,
    text='Make the element behind a running node blank.',
)
def erase(arguments: argparse.Namespace) -> int:
    """Make the element blank."""
    return _ask(arguments, lambda client: client.erase(), _decoded)


@command(
    'stop what the element behind a running node does, and let its strain go',
    *REQUEST,
    text="""\
Stop the running procedure of a node, and bring the strain to zero.

It is answered once the element is at rest; whoever asked for the procedure is told, too.""",
)
def abort(arguments: argparse.Namespace) -> int:
    """Stop the running procedure."""
    return _ask(arguments, lambda client: client.abort(), _stopped)


def _stopped(answer: Done) -> str:
    return f'stopped; the strain is at zero after {answer.ticks} ticks'


@command(
    'have the element behind a running node learn its echo delays, and restore its content',
    *REQUEST,
    text="""\
Have a running node learn the echo delay of every level.

It writes every level and restores the content: some twenty times as long as a write.""",
)
def calibrate(arguments: argparse.Namespace) -> int:
    """Learn the echo delays."""
    return _ask(arguments, lambda client: client.calibrate(), _calibrated)


def _calibrated(answer: Calibrated) -> str:
    """Return the content as a line, and the delays as a table: levels by ends."""
    columns = zip(*answer.delays.values(), strict=True)
    rows = [
        f'{level:5}' + ''.join(f'{delay:10.2f}' for delay in delays)
        for level, delays in enumerate(columns)
    ]
    headings = 'level' + ''.join(f'{end:>10}' for end in answer.delays)
    return '\n'.join([_decoded(answer), headings, *rows])


@command(
    'have the element behind a running node test every level, and restore its content',
    *REQUEST,
    text="""\
Have the element behind a running node test itself.

It writes and reads every level, tests actuator and transducers, and restores the content: some
twenty times as long as a write. Exit status 0 means that every check passed.""",
)
def self_test(arguments: argparse.Namespace) -> int:
    """Test every level."""
    return _ask(
        arguments, lambda client: client.self_test(), _tested, lambda tested: tested.passed
    )


def _tested(answer: SelfTested) -> str:
    """Return what every check found, a line each."""
    width = max(map(len, answer.checks))
    return '\n'.join(
        f'{"FAILED" if name in answer.failed else "ok":6}  {name:{width}}  {found}'
        for name, found in answer.checks.items()
    )


@command(
    'have a running node record a session, or end it',
    one_of(
        option('path', nargs='?', help='of the bag, on the machine of the node'),
        option('--stop', action='store_true', help='end the recording'),
    ),
    *REQUEST,
    text="""\
Have a running node record a session, or end the one it records.

The bag is on the machine of the node, below its `files.root`. Where the path exists the time is
added to its name; without a path the node takes its `record.path`.""",
)
def record(arguments: argparse.Namespace) -> int:
    """Record, or end the recording."""
    path = arguments.path or ''
    return _ask(arguments, lambda client: client.record(not arguments.stop, path), _recorded)


def _recorded(answer: Recorded) -> str:
    return f'{"recording into" if answer.recording else "recorded"} {answer.path}'


def _ask(
    arguments: argparse.Namespace,
    request: Callable[[MemoryClient], Reply[SomeAnswer]],
    describe: Callable[[SomeAnswer], str],
    succeeded: Callable[[SomeAnswer], bool] = lambda answer: True,
) -> int:
    """Make a request and print its answer.

    Args:
        arguments: Those of `REQUEST`.
        request: Makes it.
        describe: Says what was answered, for a person.
        succeeded: Tells whether an answer is a success.

    Returns:
        Exit status: 0 when it succeeded, 1 when it did not or no node answers.
    """
    from ..contract.errors import RequestError, RequestFailed
    from ..ros.client.standalone import standalone

    try:
        with standalone(arguments.node) as client:
            client.ready(arguments.wait).wait()
            answer = request(client).wait()
    except (RequestError, ValueError) as error:
        if arguments.json and isinstance(error, RequestFailed):
            print_json(error.answer)
        return complain(arguments.command, error, 1)
    if arguments.json:
        print_json(_as_dict(answer))
    else:
        print(describe(answer))
    return 0 if succeeded(answer) else 1


def _as_dict(answer: Answer) -> dict[str, Any]:
    """Return an answer as plain values: what it was understood as, and all that the node said."""
    fields = {field.name: getattr(answer, field.name) for field in dataclasses.fields(answer)}
    said = fields.pop('details')
    return {**fields, 'measured': said} if 'checks' in fields else {**said, **fields}


def _decoded(answer: Decoded) -> str:
    """Return a decoded content as one line."""
    text = describe_level(answer.level)
    if answer.code:
        text += f' (code {answer.code})'
    if answer.delay is not None:
        text += f', echo delay {answer.delay:.2f}'
    return (
        f'{text}, level margin {answer.level_margin:.2f}, '
        f'threshold margin {answer.threshold_margin:.2f}, confidence {answer.confidence:.2f}'
    )
