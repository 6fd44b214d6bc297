# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The sub-commands of `mlmem`, and its command line."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Sequence
from importlib import import_module

from mlmem.procedure_table import PROCEDURES
from mlmem_ros import __version__
from mlmem_ros.packages import added, missing

from . import laboratory
from .command import Command, add_commands
from .output import complain

REQUESTS = (*PROCEDURES, 'record', 'inject')
SUBCOMMANDS = (
    'demo', *REQUESTS, 'view', 'rig', 'design', 'law', 'replay',
    'inspect', 'doctor',
)  # fmt: skip
"""Each is a `Command` in a module of its name, requests among `COMMANDS` of `request`."""


def parser(names: Iterable[str] | None = None) -> argparse.ArgumentParser:
    """Return the parser of the command line, of some sub-commands, since importing all modules
    takes a while.
    """
    names = (*SUBCOMMANDS, *sorted(_added())) if names is None else names
    parser = argparse.ArgumentParser(
        prog='mlmem', description='Write, read and study mechanical multi-level memories.'
    )
    parser.add_argument('--version', action='version', version=f'mlmem_ros {__version__}')
    subparsers = parser.add_subparsers(dest='command', required=True, metavar='COMMAND')
    add_commands(subparsers, {name: _command(name) for name in names})
    return parser


def _added() -> set[str]:
    return added(laboratory.COMMANDS).keys() - set(SUBCOMMANDS)


def _command(name: str) -> Command:
    if name not in SUBCOMMANDS:
        other: Command = added(laboratory.COMMANDS)[name].load()
        return other
    module = import_module(f'.{"request" if name in REQUESTS else name}', __package__)
    found: Command = module.COMMANDS[name] if name in REQUESTS else getattr(module, name)
    return found


def run(given: Sequence[str], first: str) -> int:
    """Run the sub-command `first` with the words of its command line; return its exit status."""
    if first in laboratory.NAMES and first not in _added():
        return complain(first, missing(laboratory.absent()), 1)
    known = first in SUBCOMMANDS or first in _added()
    names = (first,) if known else () if first == '--version' else None
    parsed = parser(names).parse_args(given)
    try:
        return _command(parsed.command).run(parsed)
    except ModuleNotFoundError as error:
        return complain(parsed.command, missing(error), 1)
