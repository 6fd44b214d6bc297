# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem record`: have a running node record a session, or end the one it records.

The bag is on the machine of the node, below its `files.root`. Where the path exists the time is
added to its name; without a path the node takes its `record.path`.
"""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from . import request

if TYPE_CHECKING:
    from ..contract.answers import Recorded

SUMMARY = 'have a running node record a session, or end it'


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of this sub-command."""
    what = parser.add_mutually_exclusive_group()
    what.add_argument('path', nargs='?', help='of the bag, on the machine of the node')
    what.add_argument('--stop', action='store_true', help='end the recording')
    request.add_arguments(parser)


def run(arguments: argparse.Namespace) -> int:
    """Make the request; return the exit status."""
    return request.run(
        arguments, lambda client: client.record(not arguments.stop, arguments.path or ''), describe
    )


def describe(answer: Recorded) -> str:
    """Return an answer as one line."""
    return f'{"recording into" if answer.recording else "recorded"} {answer.path}'
