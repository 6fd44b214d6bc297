# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Commands, from their parsers."""

import argparse
import re
from collections import Counter
from collections.abc import Collection, Iterator

from mlmem_ros.ros import main
from mlmem_tools.cli import laboratory
from mlmem_tools.cli.commands import SUBCOMMAND_NAMES, build_parser

from .table import make_list

MIN_COMMON_COMMANDS = 2
"""An option that so many commands take with the same meaning is described once."""


def generate_commands() -> dict[str, str]:
    """Return every option of every command, and those that many commands take."""
    own = [*_list_subcommands(build_parser(SUBCOMMAND_NAMES))]
    others = [*_list_subcommands(build_parser(laboratory.LABORATORY_COMMANDS))]
    nodes = [(each, '') for each in (main.build_node_parser(), main.build_bank_parser())]
    every = [command for top, _ in own + others + nodes for command in _walk_commands(top)]
    counts = Counter(row for command in every for row in _list_options(command))
    common = {row for row, count in counts.items() if count >= MIN_COMMON_COMMANDS}

    return {
        'common options': make_list(row for row in counts if row in common),
        'commands': ''.join(_describe_command(each, text, common) for each, text in nodes + own),
        'laboratory': ''.join(_describe_command(each, text, common, 3) for each, text in others),
    }


def _list_subcommands(
    parser: argparse.ArgumentParser,
) -> Iterator[tuple[argparse.ArgumentParser, str]]:
    """Yield the sub-commands of a command: parser, summary."""
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            summaries = {choice.dest: choice.help or '' for choice in action._choices_actions}
            for name, each in action.choices.items():
                yield each, summaries.get(name, '')


def _walk_commands(command: argparse.ArgumentParser) -> Iterator[argparse.ArgumentParser]:
    """Yield a command and all commands below it."""
    yield command
    for each, _ in _list_subcommands(command):
        yield from _walk_commands(each)


def _list_options(command: argparse.ArgumentParser) -> Iterator[tuple[str, str]]:
    """Yield how an option is written, and what it means."""
    for action in command._actions:
        if not isinstance(
            action, argparse._HelpAction | argparse._VersionAction | argparse._SubParsersAction
        ):
            yield f'`{_spell_option(action)}`', _expand_help(command, action)


def _describe_command(
    command: argparse.ArgumentParser,
    summary: str,
    common: Collection[tuple[str, str]],
    depth: int = 2,
) -> str:
    rows = [row for row in _list_options(command) if row not in common]
    shared = ', '.join(
        row[0].split()[0].strip('`') for row in _list_options(command) if row in common
    )
    about = (command.description or f'{summary}.').strip().removeprefix(f'`{command.prog}`: ')
    parts = [
        f'{"#" * depth} `{command.prog}`',
        about[:1].upper() + about[1:],
        make_list(rows),
        f'Also `{shared}`.' if shared else '',
        command.epilog or '',
    ]
    below = ''.join(
        _describe_command(each, text, common, depth + 1)
        for each, text in _list_subcommands(command)
    )
    return '\n\n'.join(part for part in parts if part) + '\n\n' + below


def _spell_option(action: argparse.Action) -> str:
    metavar = action.metavar if isinstance(action.metavar, str) else None
    if not action.option_strings:
        return metavar or action.dest.upper()
    takes = metavar or ('|'.join(map(str, action.choices)) if action.choices else None)
    if takes is None and action.nargs != 0:
        takes = action.dest.upper()
    return ', '.join(action.option_strings) + (f' {takes}' if takes else '')


def _expand_help(command: argparse.ArgumentParser, action: argparse.Action) -> str:
    formatter = command._get_formatter()
    return re.sub(r'\s+', ' ', formatter._expand_help(action)) if action.help else ''
