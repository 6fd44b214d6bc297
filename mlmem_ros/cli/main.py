# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The command `mlmem` and its sub-commands."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable, Sequence
from importlib import import_module

from ..packages import missing
from ..version import __version__
from .command import Command, add_commands
from .output import complain

REQUESTS = ('write', 'read', 'erase', 'calibrate', 'self_test', 'abort', 'record')
SUBCOMMANDS = (
    'demo', *REQUESTS, 'watch', 'view', 'rig', 'design', 'figures', 'margins', 'replay', 'inspect',
    'bench', 'tolerance', 'doctor',
)  # fmt: skip
"""Each is a `Command` in a module of its name, requests in `request`."""


def parser(names: Iterable[str] = SUBCOMMANDS) -> argparse.ArgumentParser:
    """Return the parser of the command line.

    Args:
        names: The sub-commands to include: importing all modules takes a while.
    """
    parser = argparse.ArgumentParser(
        prog='mlmem', description='Write, read and study mechanical multi-level memories.'
    )
    parser.add_argument('--version', action='version', version=f'mlmem_ros {__version__}')
    subparsers = parser.add_subparsers(dest='command', required=True, metavar='COMMAND')
    add_commands(subparsers, {name: _command(name) for name in names})
    return parser


def _command(name: str) -> Command:
    module = import_module(f'.{"request" if name in REQUESTS else name}', __package__)
    found: Command = getattr(module, name)
    return found


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a sub-command.

    Args:
        arguments: Command line without the program's name; by default that of the process.

    Returns:
        Exit status: 0 on success.
    """
    given = sys.argv[1:] if arguments is None else arguments
    names = given[:1] if given and given[0] in SUBCOMMANDS else SUBCOMMANDS
    parsed = parser(names).parse_args(given)
    try:
        return _command(parsed.command).run(parsed)
    except ModuleNotFoundError as error:
        return complain(parsed.command, missing(error), 1)
    except KeyboardInterrupt:
        return complain(parsed.command, 'interrupted', 130)


if __name__ == '__main__':
    sys.exit(main())
