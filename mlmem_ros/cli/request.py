# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What `write`, `read` and `erase` share: one request to a running node, one line of answer."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..ros.client import MemoryClient


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of every request."""
    parser.add_argument('--node', default='mlmem', help='name of the memory node')
    parser.add_argument(
        '--wait', type=float, default=5.0, metavar='S', help='how long to wait for the node'
    )


def run(arguments: argparse.Namespace, request: Callable[[MemoryClient], dict[str, Any]]) -> int:
    """Make a request and print its answer.

    Returns:
        Exit status: 0 when it succeeded, 1 when it did not or no node answers.
    """
    from ..ros.client import MemoryClient, NoAnswer, RequestFailed

    with MemoryClient(arguments.node) as client:
        try:
            client.wait_for_node(arguments.wait)
            print(describe(request(client)))
        except (NoAnswer, RequestFailed) as error:
            print(f'mlmem {arguments.command}: {error}', file=sys.stderr)
            return 1
    return 0


def describe(answer: dict[str, Any]) -> str:
    """Return an answer as one line."""
    from ..device import describe_level

    text = describe_level(answer['level'])
    if answer['code']:
        text += f' (code {answer["code"]})'
    if answer['delay'] is not None:
        text += f', echo delay {answer["delay"]:.2f}'
    return (
        f'{text}, level margin {answer["level_margin"]:.2f}, '
        f'threshold margin {answer["threshold_margin"]:.2f}'
    )
