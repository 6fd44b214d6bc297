# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem calibrate`: have a running node learn the echo delay of every level.

It writes every level and restores the content: some twenty times as long as a write.
"""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from . import request

if TYPE_CHECKING:
    from ..contract.answers import Calibrated

SUMMARY = 'have the element behind a running node learn its echo delays, and restore its content'


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of this sub-command."""
    request.add_arguments(parser)


def run(arguments: argparse.Namespace) -> int:
    """Make the request; return the exit status."""
    return request.run(arguments, lambda client: client.calibrate(), describe)


def describe(answer: Calibrated) -> str:
    """Return the content as a line, and the delays as a table: levels by ends."""
    columns = zip(*answer.delays.values(), strict=True)
    rows = [
        f'{level:5}' + ''.join(f'{delay:10.2f}' for delay in delays)
        for level, delays in enumerate(columns)
    ]
    headings = 'level' + ''.join(f'{end:>10}' for end in answer.delays)
    return '\n'.join([request.describe(answer), headings, *rows])
