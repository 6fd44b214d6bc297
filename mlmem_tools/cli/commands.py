# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The sub-commands of `mlmem`, and its command line."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Sequence
from importlib import import_module

from mlmem.procedure_table import PROCEDURES
from mlmem_ros import __version__
from mlmem_ros.packages import describe_missing, find_entry_points

from . import laboratory
from .command import Command, add_commands
from .output import print_failure

REQUEST_NAMES = (*PROCEDURES, 'record')
SUBCOMMAND_NAMES = (
    'demo', *REQUEST_NAMES, 'view', 'rig', 'design', 'law', 'fit', 'plan', 'replay',
    'inspect', 'doctor',
)  # fmt: skip
"""Each is a `Command` in a module of its name, requests among `COMMANDS` of `request`."""


def build_parser(names: Iterable[str] | None = None) -> argparse.ArgumentParser:
    """Return the parser of the command line, of some sub-commands, since importing all modules
    takes a while.
    """
    names = (*SUBCOMMAND_NAMES, *sorted(_find_added())) if names is None else names
    parser = argparse.ArgumentParser(
        prog='mlmem', description='Write, read and study mechanical multi-level memories.'
    )
    parser.add_argument('--version', action='version', version=f'mlmem_ros {__version__}')
    subparsers = parser.add_subparsers(dest='command', required=True, metavar='COMMAND')
    add_commands(subparsers, {name: _load_command(name) for name in names})
    return parser


def _find_added() -> set[str]:
    return find_entry_points(laboratory.COMMANDS_GROUP).keys() - set(SUBCOMMAND_NAMES)


def _load_command(name: str) -> Command:
    if name not in SUBCOMMAND_NAMES:
        other: Command = find_entry_points(laboratory.COMMANDS_GROUP)[name].load()
        return other
    module = import_module(f'.{"request" if name in REQUEST_NAMES else name}', __package__)
    found: Command = module.COMMANDS[name] if name in REQUEST_NAMES else getattr(module, name)
    return found


def run_subcommand(given: Sequence[str], first: str) -> int:
    """Run the sub-command `first` with the words of its command line; return its exit status."""
    if first in laboratory.LABORATORY_COMMANDS and first not in _find_added():
        return print_failure(first, describe_missing(laboratory.build_absent_error()), 1)
    known = first in SUBCOMMAND_NAMES or first in _find_added()
    names = (first,) if known else () if first == '--version' else None
    parsed = build_parser(names).parse_args(given)
    try:
        return _load_command(parsed.command).run(parsed)
    except ModuleNotFoundError as error:
        return print_failure(parsed.command, describe_missing(error), 1)
