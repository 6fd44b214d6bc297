# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem self_test`: have the element behind a running node test itself.

It writes and reads every level, tests actuator and transducers, and restores the content: some
twenty times as long as a write. Exit status 0 means that every check passed.
"""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from . import request

if TYPE_CHECKING:
    from ..contract.answers import SelfTested

SUMMARY = 'have the element behind a running node test every level, and restore its content'


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of this sub-command."""
    request.add_arguments(parser)


def run(arguments: argparse.Namespace) -> int:
    """Make the request, print a line for every check; return the exit status."""
    return request.run(
        arguments, lambda client: client.self_test(), describe, lambda tested: tested.passed
    )


def describe(tested: SelfTested) -> str:
    """Return what every check found, a line each."""
    width = max(map(len, tested.checks))
    return '\n'.join(
        f'{"FAILED" if name in tested.failed else "ok":6}  {name:{width}}  {found}'
        for name, found in tested.checks.items()
    )
