# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem self_test`: have the element behind a running node test itself.

It writes and reads every level, tests actuator and transducers, and restores the content: some
twenty times as long as a write. Exit status 0 means that every check passed.
"""

from __future__ import annotations

import argparse
import sys

from . import request

SUMMARY = 'have the element behind a running node test every level, and restore its content'


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of this sub-command."""
    request.add_arguments(parser)


def run(arguments: argparse.Namespace) -> int:
    """Make the request, print a line for every check; return the exit status."""
    from ..ros.errors import RequestError
    from ..ros.standalone import standalone

    with standalone(arguments.node) as client:
        try:
            client.ready(arguments.wait).wait()
            tested = client.self_test().wait()
        except RequestError as error:
            print(f'mlmem self_test: {error}', file=sys.stderr)
            return 1
    width = max(map(len, tested.checks))
    for name, found in tested.checks.items():
        print(f'{"FAILED" if name in tested.failed else "ok":6}  {name:{width}}  {found}')
    return 0 if tested.passed else 1
