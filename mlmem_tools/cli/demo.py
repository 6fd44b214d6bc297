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
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mlmem_ros.contract.answers import RequestError

from . import laboratory
from .command import JSON_OPTION, declare_command, declare_option
from .output import create_console, print_json, print_rows, show_progress

if TYPE_CHECKING:
    from mlmem import Reading
    from mlmem_ros.contract.answers import Decoded


DEMO_LEVELS = (0, 1, 2, 3, 4, 5, 6, 7, 3, 5)
"""The levels that are written: all of them upward, one downward, one upward again."""

Row = dict[str, Any]
"""A level that was written and read, for the table."""


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
    console, rows = create_console(aside=arguments.json), list[Row]()
    folder = None
    if find_spec('rclpy') is not None:
        folder = arguments.output / time.strftime('demo-%Y%m%d-%H%M%S')
    written = _write_directly() if folder is None else _write_through_ros(folder)
    try:
        show_progress(console, map(rows.append, written), len(DEMO_LEVELS), 'levels')
    except (RequestError, RuntimeError) as error:
        console.print(f'the demonstration failed: {error}', style='red')
        return 1
    print_rows(console, 'written and read back by echo', rows)
    found: dict[str, Any] = {'levels': rows}
    if folder is not None:
        found['session'] = folder / 'session'
        if part := laboratory.find_parts().get('session_figure'):
            found['picture'] = part.load()(found['session'], folder / 'session.png')
        for name in list(found)[1:]:
            console.print(f'{name:8} {found[name]}')
    if arguments.json:
        print_json(found)
    return 0 if all(row['decoded'] == row['asked'] for row in rows) else 1


def _build_row(level: int, answer: Decoded | Reading, walls: list[float], duration: float) -> Row:
    return {
        'asked': level,
        'decoded': answer.level,
        'code': answer.code,
        'echo delay': answer.delay,
        'threshold margin': answer.threshold_margin,
        'confidence': answer.confidence,
        'true wall': walls[0] if len(walls) == 1 else 'none',
        'duration, s': duration,
    }


def _write_directly() -> Iterator[Row]:
    """Write and read the levels of an element in this process.

    Raises:
        RuntimeError: A write or a read failed.
    """
    from mlmem import MemoryElement, Read, Write, load_element
    from mlmem.physics import find_walls

    element = MemoryElement(load_element('case_2'))
    for level in DEMO_LEVELS:
        begun = time.monotonic()
        written = element.perform(Write(level))
        if not written.success:
            raise RuntimeError(f'write failed: {written.error}')
        reading = element.perform(Read()).reading
        if reading is None:
            raise RuntimeError('no echo could be recorded')
        walls = find_walls(element.design, element.chain.configuration)
        places = [wall.position for wall in walls]
        yield _build_row(level, reading, places, time.monotonic() - begun)


def _write_through_ros(folder: Path) -> Iterator[Row]:
    """Write and read the levels of a node of our own, which records a session in a new folder.

    Raises:
        RequestError: A write or a read failed, or the node does not answer.
    """
    from std_msgs.msg import Float64MultiArray

    from mlmem_ros.contract.topics import Qos
    from mlmem_ros.ros.client.client import standalone, wait_until
    from mlmem_ros.ros.node_process import build_node_arguments, run_node_process

    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    os.environ.setdefault('ROS_DOMAIN_ID', str(random.randint(1, 100)))
    name = f'mlmem_demo_{os.getpid()}'  # a robot's own /mlmem may be in this domain
    folder.mkdir(parents=True)
    given = build_node_arguments(name, {'record.path': str(folder / 'session')})
    walls: list[Any] = []
    with (
        (folder / 'memory_node.log').open('wb') as log,
        run_node_process(given, stdout=log, stderr=log),
        standalone(name) as client,
    ):
        timeout_s = 60.0  # with a cold cache, the node compiles its kernels
        client.ready(timeout_s).wait()
        client.read(timeout_s).wait()
        client.node.create_subscription(
            Float64MultiArray, f'{client.name}/wall', walls.append, Qos.SENSOR_DATA.profile
        )
        for level in DEMO_LEVELS:
            begun = time.monotonic()
            client.write(level).wait()
            answer = client.read().wait()
            duration = time.monotonic() - begun
            walls.clear()
            wait_until(lambda: walls, f'{client.name}/wall')
            yield _build_row(level, answer, list(walls[-1].data), duration)
