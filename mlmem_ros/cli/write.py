# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem write`: write a level into the element behind a running node."""

from __future__ import annotations

import argparse

from . import request

SUMMARY = 'write a level into the element behind a running node'


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of this sub-command."""
    parser.add_argument('level', type=int, help='level to write, from 0')
    request.add_arguments(parser)


def run(arguments: argparse.Namespace) -> int:
    """Make the request; return the exit status."""
    return request.run(arguments, lambda client: client.write(arguments.level), request.describe)
