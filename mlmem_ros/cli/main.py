# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The command `mlmem` and its sub-commands."""

from __future__ import annotations

import argparse
import importlib
import sys
from collections.abc import Sequence

from .. import __version__
from ..packages import missing

SUBCOMMANDS = (
    'demo',
    'write',
    'read',
    'erase',
    'calibrate',
    'self_test',
    'abort',
    'record',
    'watch',
    'view',
    'design',
    'figures',
    'margins',
    'replay',
    'inspect',
    'bench',
    'tolerance',
    'doctor',
)
"""Modules of this package, each with SUMMARY, add_arguments(parser) and run(arguments)."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a sub-command.

    Args:
        arguments: Command line without the program's name; by default that of the process.

    Returns:
        Exit status: 0 on success.
    """
    parser = argparse.ArgumentParser(
        prog='mlmem', description='Write, read and study mechanical multi-level memories.'
    )
    parser.add_argument('--version', action='version', version=f'mlmem_ros {__version__}')
    subparsers = parser.add_subparsers(dest='command', required=True, metavar='COMMAND')
    given = sys.argv[1:] if arguments is None else arguments
    # The modules of the other ones take a while, too.
    names = given[:1] if given and given[0] in SUBCOMMANDS else SUBCOMMANDS
    modules = {name: importlib.import_module(f'.{name}', __package__) for name in names}
    for name, module in modules.items():
        subparser = subparsers.add_parser(
            name, help=module.SUMMARY, description=module.__doc__, formatter_class=_Formatter
        )
        module.add_arguments(subparser)
    parsed = parser.parse_args(arguments)
    try:
        status: int = modules[parsed.command].run(parsed)
    except ModuleNotFoundError as error:
        print(f'mlmem {parsed.command}: {missing(error)}', file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print(f'mlmem {parsed.command}: interrupted', file=sys.stderr)
        return 130
    return status


class _Formatter(argparse.RawDescriptionHelpFormatter, argparse.ArgumentDefaultsHelpFormatter):
    """Keeps the line breaks of a description and shows the defaults."""


if __name__ == '__main__':
    sys.exit(main())
