# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem demo`: write every level through ROS 2, read each back, show and record it.

Without ROS 2 the element runs in this process, and nothing is recorded.
"""

from __future__ import annotations

import argparse
import os
import random
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mlmem_ros.packages import find_entry_points

from . import laboratory
from .command import JSON_OPTION, declare_command, declare_option
from .interrupts import note_outcome
from .output import create_console, create_table, print_json, show_progress

if TYPE_CHECKING:
    from rich.console import Console

    from mlmem import MemoryElement, Reading
    from mlmem_ros.contract.answers import Decoded
    from mlmem_ros.ros.client.client import MemoryClient


DEMO_LEVELS = (0, 1, 2, 3, 4, 5, 6, 7, 3, 5)
"""The levels that are written: all of them upward, one downward, one upward again."""

NODE_START_TIMEOUT_S = 60.0
"""Longest wait for the node, in seconds: the first start compiles the kernels."""


@dataclass(frozen=True)
class Written:
    """One line of the table."""

    asked: int
    answer: Decoded | Reading
    wall: float | None
    duration: float


@declare_command(
    'write every level up and some down through ROS 2, read each back, show it',
    declare_option(
        '--output', type=Path, default=Path('sessions'), help='folder for session and picture'
    ),
    JSON_OPTION,
    text=__doc__,
)
def demo(arguments: argparse.Namespace) -> int:
    """Run the demonstration; return 0 only if every level read is the one written."""
    if find_spec('rclpy') is None:
        return _demonstrate_without_ros(arguments)
    from mlmem_ros.contract.calls import RequestError
    from mlmem_ros.ros.node_process import build_node_arguments, run_node_process
    from mlmem_ros.session.data import load_session

    console = create_console(aside=arguments.json)
    folder: Path = arguments.output / time.strftime('demo-%Y%m%d-%H%M%S')
    session = folder / 'session'
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    os.environ.setdefault('ROS_DOMAIN_ID', str(random.randint(1, 100)))
    name = f'mlmem_demo_{os.getpid()}'  # a robot's own /mlmem may be in this domain
    folder.mkdir(parents=True)
    given = build_node_arguments(name, {'record.path': str(session)})
    try:
        with (
            (folder / 'memory_node.log').open('wb') as log,
            run_node_process(given, stdout=log, stderr=log),
        ):
            rows = _write_and_read(console, name)
    except RequestError as error:
        console.print(f'the demonstration failed: {error}', style='red')
        return 1
    note_outcome()
    _print_table(console, rows, 'written through ROS 2 and read back by echo')
    console.print(f'session  {session}')
    picture = None
    if laboratory.PICTURE_PART in find_entry_points(laboratory.PARTS_GROUP):
        picture = laboratory.load_part(laboratory.PICTURE_PART)(
            load_session(session), folder / 'session.png'
        )
        console.print(f'picture  {picture}')
    if arguments.json:
        print_json({'levels': rows, 'session': session, 'picture': picture})
    return _exit_status(rows)


def _exit_status(rows: Iterable[Written]) -> int:
    return 0 if all(row.answer.level == row.asked for row in rows) else 1


def _demonstrate_without_ros(arguments: argparse.Namespace) -> int:
    """Write and read the levels of an element in this process."""
    from mlmem import MemoryElement, load_element

    console = create_console(aside=arguments.json)
    element = MemoryElement(load_element('case_2'))
    rows: list[Written] = []
    written = _write_and_read_directly(element)
    try:
        show_progress(console, map(rows.append, written), 0, len(DEMO_LEVELS), 'levels')
    except RuntimeError as error:
        console.print(f'the demonstration failed: {error}', style='red')
        return 1
    _print_table(console, rows, 'written without ROS 2 and read back by echo')
    if arguments.json:
        print_json({'levels': rows})
    return _exit_status(rows)


def _write_and_read_directly(element: MemoryElement) -> Iterator[Written]:
    """Yield a row per level.

    Raises:
        RuntimeError: A write or a read failed.
    """
    from mlmem import Read, Write
    from mlmem.physics import find_walls

    for level in DEMO_LEVELS:
        begun = time.monotonic()
        written = element.perform(Write(level))
        if not written.success:
            raise RuntimeError(f'write failed: {written.error}')
        reading = element.perform(Read()).reading
        if reading is None:
            raise RuntimeError('no echo could be recorded')
        duration = time.monotonic() - begun
        walls = find_walls(element.design, element.chain.configuration)
        position = walls[0].position if len(walls) == 1 else None
        yield Written(level, reading, position, duration)


def _write_and_read(console: Console, name: str) -> list[Written]:
    from std_msgs.msg import Float64MultiArray

    from mlmem_ros.ros.client.client import standalone
    from mlmem_ros.ros.middleware import SENSOR_DATA_PROFILE

    rows: list[Written] = []
    walls: list[Any] = []
    with standalone(name) as client:
        with console.status('waiting for the memory node'):
            client.ready(NODE_START_TIMEOUT_S).wait()
            client.read(
                NODE_START_TIMEOUT_S
            ).wait()  # with a cold cache, it compiles its kernels first
        client.node.create_subscription(
            Float64MultiArray, f'{client.name}/wall', walls.append, SENSOR_DATA_PROFILE
        )
        written = (_write_one_level(client, asked, walls) for asked in DEMO_LEVELS)
        show_progress(console, map(rows.append, written), 0, len(DEMO_LEVELS), 'levels')
    return rows


def _write_one_level(client: MemoryClient, asked: int, walls: list[Any]) -> Written:
    from mlmem_ros.ros.client.client import wait_until

    begun = time.monotonic()
    client.write(asked).wait()
    answer = client.read().wait()
    duration = time.monotonic() - begun
    walls.clear()
    wait_until(lambda: walls, f'{client.name}/wall')
    positions = list(walls[-1].data)
    return Written(asked, answer, positions[0] if len(positions) == 1 else None, duration)


def _print_table(console: Console, rows: list[Written], title: str) -> None:
    from rich.text import Text

    table = create_table(
        title,
        '>asked', '>decoded', '>code', '>echo delay', '>threshold margin', '>confidence',
        '>true wall', '>duration',
    )  # fmt: skip
    for row in rows:
        answer, right = row.answer, row.answer.level == row.asked
        table.add_row(
            str(row.asked),
            Text(str(answer.level), 'green' if right else 'red'),
            answer.code,
            'none' if answer.delay is None else f'{answer.delay:.2f}',
            f'{answer.threshold_margin:.2f}',
            f'{answer.confidence:.2f}',
            'none' if row.wall is None else f'{row.wall:.2f}',
            f'{row.duration:.2f} s',
        )
    console.print(table)
