# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The executables `memory_node` and `memory_bank`, with their options besides those of ROS; they
handle signals before loading the rest.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence

from .. import __version__
from .node_process import handle_signals, ignore_signals, received_signals, use_profile


def parse_node_arguments(arguments: Sequence[str]) -> list[str]:
    """Return a command line, the program first, if it has only options of ROS.

    Raises:
        SystemExit: There is another option, or help or the version was requested.
    """
    return _parse_arguments(build_node_parser(), arguments)[1]


def parse_bank_arguments(arguments: Sequence[str]) -> tuple[list[str], list[dict[str, str]]]:
    """Return the ROS arguments of a bank, and those of each of its nodes; see
    `parse_node_arguments`.
    """
    given, of_ros = _parse_arguments(build_bank_parser(), arguments)
    if not given.actions:
        of_ros += ['--ros-args', '-p', 'actions:=false']
    namespace, rest = '/bank', of_ros[:1]
    for word in of_ros[1:]:
        if word.startswith('__ns:='):
            namespace = word.removeprefix('__ns:=').rstrip('/')
            rest.pop()  # its -r
        else:
            rest.append(word)
    elements = []
    for place in range(given.elements):
        element = {'namespace': f'{namespace}/element_{place}'}
        if given.record:
            element['record.path'] = f'{given.record}/element_{place}'
        if given.state:
            element['state.path'] = f'{given.state}/element_{place}.json'
        elements.append(element)
    return rest, elements


def build_node_parser() -> argparse.ArgumentParser:
    """Return the parser of the plain options of `memory_node`."""
    return _build_parser('memory_node', 'One mechanical memory element as a ROS 2 node.')


def build_bank_parser() -> argparse.ArgumentParser:
    """Return the parser of the plain options of `memory_bank`."""
    parser = _build_parser('memory_bank', 'Several mechanical memory elements in one process.')
    parser.add_argument(
        '--elements',
        type=_parse_count,
        default=4,
        metavar='NUMBER',
        help='how many (default: %(default)s); element i is NAMESPACE/element_i/mlmem, in '
        '/bank unless "-r __ns:=NAMESPACE" names another',
    )
    parser.add_argument('--record', default='', metavar='FOLDER', help='folder of the sessions')
    parser.add_argument('--state', default='', metavar='FOLDER', help='folder of the state files')
    parser.add_argument(
        '--actions',
        action='store_true',
        help='serve actions, too, which takes memory in a large bank',
    )
    return parser


def _build_parser(program: str, description: str) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        program,
        description=description,
        epilog='Parameters are set behind --ros-args by -p NAME:=VALUE.',
        allow_abbrev=False,
    )
    parser.add_argument('--version', action='version', version=f'mlmem_ros {__version__}')
    return parser


def _parse_arguments(
    parser: argparse.ArgumentParser, arguments: Sequence[str]
) -> tuple[argparse.Namespace, list[str]]:
    """Return the plain options, and the ROS command line."""
    plain, of_ros = _split_arguments(arguments[1:])
    given = parser.parse_args(plain)
    return given, [*arguments[:1], *of_ros]


def _split_arguments(arguments: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return the plain arguments, and ROS's: from each `--ros-args` to `--` or the end."""
    plain: list[str] = []
    of_ros: list[str] = []
    mine = plain
    for argument in arguments:
        if argument == '--ros-args':
            mine = of_ros
        mine.append(argument)
        if argument == '--':
            mine = plain
    return plain, of_ros


def _parse_count(text: str) -> int:
    if not (text.isdecimal() and 1 <= int(text) <= 128):  # more are probably a mistake
        raise argparse.ArgumentTypeError(f'must be a number from 1 to 128; got {text!r}')
    return int(text)


def main(arguments: Sequence[str] | None = None, several: bool = False) -> int:
    """Run one memory node, or as `memory_bank` several, until SIGINT or SIGTERM, with the
    process's command line by default; return the exit status of `node.run`.

    We handle signals ourselves: rclpy's handler would shut the context down before the session
    file is closed and pending requests are answered.
    """
    handle_signals()
    use_profile(os.environ)
    given = sys.argv if arguments is None else arguments
    given, elements = (
        parse_bank_arguments(given) if several else (parse_node_arguments(given), ({},))
    )
    from .node.run import run_nodes  # takes a second or two, in which a signal must not raise

    if received_signals:
        ignore_signals()
        return 0
    return run_nodes(given, received_signals, elements)


def bank(arguments: Sequence[str] | None = None) -> int:
    """Run several memory nodes in one process, as `main` runs one."""
    return main(arguments, several=True)


if __name__ == '__main__':
    sys.exit(main())
