# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Commands, from their parsers."""

import argparse
import re
from collections.abc import Iterator

from mlmem_ros.ros import main
from mlmem_tools.cli import laboratory
from mlmem_tools.cli.commands import SUBCOMMAND_NAMES, build_parser

from .table import table


def commands_page() -> str:
    """Return every option of every command."""
    own = ''.join(
        _command(each, summary) for each, summary in _sub(build_parser(SUBCOMMAND_NAMES))
    )
    others = ''.join(
        _command(each, text, 3)
        for each, text in _sub(build_parser(laboratory.LABORATORY_COMMANDS))
    )
    nodes = ''.join(
        _command(each) for each in (main.build_node_parser(), main.build_bank_parser())
    )
    return (
        '# Commands\n\n'
        'Where ROS is installed by apt, put `ros2 run mlmem_ros` before each of them. '
        'Exit status: 0 success, 1 failure, 2 a wrong command line, '
        '130 interrupted; of a node: 0 everything saved, 1 it could not start, 2 a wrong command '
        f'line, 3 it could not save.\n\n{nodes}{own}'
        f'## The laboratory\n\nCommands of the package mlmem_lab.\n\n{others}'
    )


def _sub(parser: argparse.ArgumentParser) -> Iterator[tuple[argparse.ArgumentParser, str]]:
    """Yield the sub-commands of a command: parser, summary."""
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            summaries = {choice.dest: choice.help or '' for choice in action._choices_actions}
            for name, each in action.choices.items():
                yield each, summaries.get(name, '')


def _command(command: argparse.ArgumentParser, summary: str = '', depth: int = 2) -> str:
    rows = [
        [f'`{_spelt(action)}`', _help(command, action)]
        for action in command._actions
        if not isinstance(
            action, argparse._HelpAction | argparse._VersionAction | argparse._SubParsersAction
        )
    ]
    about = (command.description or f'{summary}.').strip().removeprefix(f'`{command.prog}`: ')
    parts = [
        f'{"#" * depth} `{command.prog}`',
        about[:1].upper() + about[1:],
        table(['option', 'meaning'], rows) if rows else '',
        command.epilog or '',
    ]
    below = ''.join(_command(each, text, depth + 1) for each, text in _sub(command))
    return '\n\n'.join(part for part in parts if part) + '\n\n' + below


def _spelt(action: argparse.Action) -> str:
    metavar = action.metavar if isinstance(action.metavar, str) else None
    if not action.option_strings:
        return metavar or action.dest.upper()
    takes = metavar or ('|'.join(map(str, action.choices)) if action.choices else None)
    if takes is None and action.nargs != 0:
        takes = action.dest.upper()
    return ', '.join(action.option_strings) + (f' {takes}' if takes else '')


def _help(command: argparse.ArgumentParser, action: argparse.Action) -> str:
    formatter = command._get_formatter()
    return re.sub(r'\s+', ' ', formatter._expand_help(action)) if action.help else ''
