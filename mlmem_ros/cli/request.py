# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What `write`, `read` and `erase` share: one request to a running node, one line of answer."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..ros.answers import Decoded
    from ..ros.client import MemoryClient
    from ..ros.reply import Reply


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of every request."""
    parser.add_argument('--node', default='mlmem', help='name of the memory node')
    parser.add_argument(
        '--wait', type=float, default=5.0, metavar='S', help='how long to wait for the node'
    )


def run(arguments: argparse.Namespace, request: Callable[[MemoryClient], Reply[Decoded]]) -> int:
    """Make a request and print its answer.

    Returns:
        Exit status: 0 when it succeeded, 1 when it did not or no node answers.
    """
    from ..ros.errors import RequestError
    from ..ros.standalone import standalone

    with standalone(arguments.node) as client:
        try:
            client.ready(arguments.wait).wait()
            print(describe(request(client).wait()))
        except (RequestError, ValueError) as error:
            print(f'mlmem {arguments.command}: {error}', file=sys.stderr)
            return 1
    return 0


def describe(answer: Decoded) -> str:
    """Return an answer as one line."""
    from ..device import describe_level

    text = describe_level(answer.level)
    if answer.code:
        text += f' (code {answer.code})'
    if answer.delay is not None:
        text += f', echo delay {answer.delay:.2f}'
    return (
        f'{text}, level margin {answer.level_margin:.2f}, '
        f'threshold margin {answer.threshold_margin:.2f}, confidence {answer.confidence:.2f}'
    )
