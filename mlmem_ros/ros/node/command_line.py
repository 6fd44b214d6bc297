# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Plain options of the executable `memory_node`, for what is asked of it most, beside ROS's."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from ... import __version__


def ros_arguments(arguments: Sequence[str]) -> list[str]:
    """Return a command line with its plain options turned into ROS parameters.

    Args:
        arguments: The command line, the program first.

    Raises:
        SystemExit: An option is not known or has a bad value, or help was asked for.
    """
    parser = argparse.ArgumentParser(
        'memory_node',
        description='One mechanical memory element as a ROS 2 node.',
        epilog='Everything else is a parameter (-p NAME:=VALUE), see docs/reference/parameters.md',
        allow_abbrev=False,
    )
    parser.add_argument(
        '--speed',
        type=_speed,
        metavar='FACTOR',
        help='factor on real time, or "max" for as fast as it can: the parameter time.speed',
    )
    parser.add_argument(
        '--view',
        action='store_true',
        help='serve its page and print the address, as "mlmem view" does: the parameter view',
    )
    parser.add_argument('--version', action='version', version=f'mlmem_ros {__version__}')
    plain, of_ros = _parted(arguments[1:])
    given = parser.parse_args(plain)
    if given.speed is not None:
        of_ros += ['--ros-args', '-p', f'time.speed:={given.speed!r}']
    if given.view:
        of_ros += ['--ros-args', '-p', 'view:=true']
    return [*arguments[:1], *of_ros]


def _parted(arguments: Sequence[str]) -> tuple[list[str], list[str]]:
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


def _speed(text: str) -> float:
    try:
        factor = 0.0 if text == 'max' else float(text)
    except ValueError:
        factor = -1.0
    if not (text == 'max' or 0.0 < factor <= 1e6):  # false for NaN, too
        raise argparse.ArgumentTypeError(
            f'must be a number above 0 and at most 1e6, or "max"; got {text!r}'
        )
    return factor
