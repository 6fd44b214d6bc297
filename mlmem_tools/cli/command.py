# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How a sub-command is declared, as a function with options and help text."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mlmem.element_file import Element

Option = Callable[[argparse.ArgumentParser], object]
"""Adds itself to a parser."""

CommandFunction = Callable[[argparse.Namespace], int]


@dataclass(frozen=True)
class Command:
    """A sub-command.

    Attributes:
        text: Its help text above the options.
        options: In order.
        run: Does it, and returns the exit status.
    """

    summary: str
    text: str
    options: tuple[Option, ...]
    run: CommandFunction


def declare_command(
    summary: str, *options: Option, text: str | None
) -> Callable[[CommandFunction], Command]:
    """Return a decorator that makes a function a sub-command; arguments as for `Command`."""
    return lambda run: Command(summary, text or '', options, run)


def declare_option(*names: str, **settings: Any) -> Option:
    """Return an option, as `argparse.ArgumentParser.add_argument` takes it."""
    return lambda parser: parser.add_argument(*names, **settings)


def declare_tasks(**commands: Command) -> Option:
    """Return sub-commands of a sub-command, by name; `task` of the arguments is the one given."""

    def add_tasks(parser: argparse.ArgumentParser) -> None:
        add_commands(parser.add_subparsers(dest='task', metavar='TASK'), commands)

    return add_tasks


NODE_OPTION = declare_option('--node', default='mlmem', help='name of the memory node')

JOBS_OPTION = declare_option(
    '--jobs', type=int, metavar='N', help='parallel processes; default: one per core'
)

JSON_OPTION = declare_option(
    '--json', action='store_true', help='print the result as one JSON object, and nothing else'
)


def load_judged_element(source: str) -> tuple[Element, Element | None]:
    """Return a shipped element, or the one in a file; and once more if it is not exactly as
    designed, or has pulses of its own.

    Raises:
        ElementFileError: There is no such element.
    """
    from mlmem.element_file import load_element

    element = load_element(source)
    as_designed = element.specimen.is_ideal and element.time_unit == 1.0 and element.plan is None
    return element, None if as_designed else element


def add_commands(subparsers: Any, commands: Mapping[str, Command]) -> None:
    """Add sub-commands to a parser, by name."""
    for name, each in commands.items():
        parser = subparsers.add_parser(
            name, help=each.summary, description=each.text, formatter_class=_Formatter
        )
        for add in each.options:
            add(parser)


class _Formatter(argparse.RawDescriptionHelpFormatter, argparse.ArgumentDefaultsHelpFormatter):
    """Keeps the line breaks of a description and shows defaults that say something."""

    def _get_help_string(self, action: argparse.Action) -> str | None:
        return super()._get_help_string(action) if action.default else action.help
