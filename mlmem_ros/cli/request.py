# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the commands share that make one request to a running node and print its answer."""

from __future__ import annotations

import argparse
import dataclasses
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeVar

from ..words import describe_level
from .console import complain
from .output import add_json, print_json

if TYPE_CHECKING:
    from ..contract.answers import Answer, Decoded
    from ..ros.client.client import MemoryClient
    from ..ros.client.reply import Reply

SomeAnswer = TypeVar('SomeAnswer', bound='Answer')


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of every request."""
    parser.add_argument('--node', default='mlmem', help='name of the memory node')
    parser.add_argument(
        '--wait', type=float, default=5.0, metavar='S', help='how long to wait for the node'
    )
    add_json(parser)


def run(
    arguments: argparse.Namespace,
    request: Callable[[MemoryClient], Reply[SomeAnswer]],
    describe: Callable[[SomeAnswer], str],
    succeeded: Callable[[SomeAnswer], bool] = lambda answer: True,
) -> int:
    """Make a request and print its answer.

    Args:
        arguments: Those of `add_arguments`.
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
        complain(arguments.command, error)
        return 1
    if arguments.json:
        print_json(as_dict(answer))
    else:
        print(describe(answer))
    return 0 if succeeded(answer) else 1


def as_dict(answer: Answer) -> dict[str, Any]:
    """Return an answer as plain values: what it was understood as, and all that the node said."""
    fields = {field.name: getattr(answer, field.name) for field in dataclasses.fields(answer)}
    said = fields.pop('details')
    return {**fields, 'measured': said} if 'checks' in fields else {**said, **fields}


def describe(answer: Decoded) -> str:
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
