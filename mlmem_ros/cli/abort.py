# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem abort`: stop the running procedure of a node, and bring the strain to zero.

It is answered once the element is at rest; whoever asked for the procedure is told, too.
"""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from . import request

if TYPE_CHECKING:
    from ..contract.answers import Done

SUMMARY = 'stop what the element behind a running node does, and let its strain go'


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of this sub-command."""
    request.add_arguments(parser)


def run(arguments: argparse.Namespace) -> int:
    """Make the request; return the exit status."""
    return request.run(arguments, lambda client: client.abort(), describe)


def describe(answer: Done) -> str:
    """Return an answer as one line."""
    return f'stopped; the strain is at zero after {answer.ticks} ticks'
