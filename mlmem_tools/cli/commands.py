# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The sub-commands of `mlmem`, and its command line."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Sequence
from importlib import import_module
from importlib.metadata import EntryPoint

from mlmem.procedure_table import PROCEDURES
from mlmem_ros import __version__
from mlmem_ros.packages import describe_missing, find_entry_points

from . import laboratory
from .command import Command, add_commands
from .output import print_failure

SUBCOMMAND_NAMES = (
    'demo', *PROCEDURES, 'record', 'view', 'rig', 'design', 'law', 'fit', 'plan', 'replay',
    'inspect', 'doctor',
)  # fmt: skip
"""Each is a `Command` in a module of its name; `request.build_command` makes those of requests."""


def build_parser(names: Iterable[str] | None = None) -> argparse.ArgumentParser:
    """Return the parser of the command line, of some sub-commands, since importing all modules
    takes a while.
    """
    names = (*SUBCOMMAND_NAMES, *sorted(_find_others())) if names is None else names
    parser = argparse.ArgumentParser(
        prog='mlmem', description='Write, read and study mechanical multi-level memories.'
    )
    parser.add_argument('--version', action='version', version=f'mlmem_ros {__version__}')
    subparsers = parser.add_subparsers(dest='command', required=True, metavar='COMMAND')
    add_commands(subparsers, {name: _load_command(name) for name in names})
    return parser


def _find_others() -> dict[str, EntryPoint]:
    """Return the commands that other packages add, by name; each is a `Command`."""
    found = find_entry_points('mlmem.commands')
    return {name: found[name] for name in found.keys() - set(SUBCOMMAND_NAMES)}


def _load_command(name: str) -> Command:
    found: Command
    if name not in SUBCOMMAND_NAMES:
        found = _find_others()[name].load()
    elif name in PROCEDURES or name == 'record':
        found = import_module('.request', __package__).build_command(name)
    else:
        found = getattr(import_module(f'.{name}', __package__), name)
    return found


def run_subcommand(given: Sequence[str], first: str) -> int:
    """Run the sub-command `first` with the words of its command line; return its exit status."""
    if first in laboratory.LABORATORY_COMMANDS and first not in _find_others():
        return print_failure(first, describe_missing(laboratory.build_absent_error()), 1)
    known = first in SUBCOMMAND_NAMES or first in _find_others()
    names = (first,) if known else () if first == '--version' else None
    parsed = build_parser(names).parse_args(given)
    try:
        return _load_command(parsed.command).run(parsed)
    except ModuleNotFoundError as error:
        return print_failure(parsed.command, describe_missing(error), 1)
