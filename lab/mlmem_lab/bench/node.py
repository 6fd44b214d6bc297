# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The node at its defaults: share of a core, tick lateness, read latency, start, memory.

Requests come from another process. The time of a read beyond the ticks that the material needs is
the latency of client, transport, command and loop. On a machine that was busy before, the figures
say little, and are marked.
"""

from __future__ import annotations

import json
import os
import random
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from datetime import date
from functools import partial
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING

from ..results import load_kept, save_result
from .measure import ResultTable, describe_processor, format_number

if TYPE_CHECKING:
    from mlmem_ros.ros.client.client import MemoryClient


def run(repeats: int) -> ResultTable:
    """Start nodes one after another, at least three, and return their figures."""
    os.environ['ROS_DOMAIN_ID'] = str(random.randint(1, 100))
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    count, load = max(3, repeats // 2), os.getloadavg()[0]
    with NodeProcess():  # fills the cache of compiled loops
        pass
    found = [measure_node() for _ in range(count)]
    figures = {
        'share': ('processor at rest, nobody listens, % of a core', 'at most 1'),
        'streams': (
            'processor at rest, somebody listens to the streams, % of a core',
            'at most 3',
        ),
        'writing': ('processor, one write after another, % of a core', 'at most 6'),
        'busy': ('work per tick while writing, us', 'at most 60'),
        'factor': ('speed at rest, as fast as possible, times real time', 'at least 1000'),
        'p99': ('tick lateness p99, ms', 'at most 1'),
        'overruns': ('ticks skipped', 'at most 0'),
        'latency': ('read latency beyond the physics, p50, ms', 'at most 1'),
        'ready': ('start-up time, warm cache, s', 'at most 1'),
        'memory': ('memory, MB', ''),
    }
    rows = [
        build_row(name, goal, [each[key] for each in found], load)
        for key, (name, goal) in figures.items()
    ]
    caption = f'{count} nodes; load average before: {load:.2f}'
    return ResultTable('The node at its defaults', caption, rows)


def build_row(name: str, goal: str, values: Sequence[float], load: float) -> dict[str, str]:
    """Return the row of a figure from its values, and the load average before; its goal is
    `at most 3` or `at least 3`, or empty.
    """
    mark = ' (busy)' if load > 0.2 else ''
    value = format_number(median(values)) + mark
    return {'figure': name, 'goal': goal, 'value': value}


def measure_node() -> dict[str, float]:
    """Return the figures of a node."""
    from mlmem_ros.ros.client.client import standalone

    with NodeProcess() as node, standalone() as memory:
        idle, fast = node.watch_node(), node.watch_node(speed=0.0)
        memory.ready().wait()
        writing = node.watch_node(partial(write_levels, memory))
        latency = median(measure_latency_ms(memory) for _ in range(15))
        subscribe_streams(memory)
        streams = node.watch_node(time.sleep)
    return {
        **{key: idle[key] for key in ('share', 'p99', 'overruns', 'memory')},
        'factor': fast['factor'],
        'writing': writing['share'],
        'busy': writing['busy'],
        'latency': latency,
        'streams': streams['share'],
        'ready': node.ready_time_s,
    }


class NodeProcess:
    """A `node_probe`, for the duration of a `with`.

    Attributes:
        ready_time_s: Seconds from the start of the process until it was ready.
    """

    def __init__(self) -> None:
        command = [sys.executable, '-m', f'{__package__}.node_probe', str(time.time())]
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
            stderr=subprocess.DEVNULL,
        )  # fmt: skip
        self.ready_time_s: float = self._read_report()['ready']

    def __enter__(self) -> NodeProcess:
        time.sleep(5.0)  # discovery is under way
        return self

    def __exit__(self, *_: object) -> None:
        self._process.__exit__(None, None, None)  # closes its input, and waits for its end

    def watch_node(
        self, use_node: Callable[[float], object] = lambda seconds: None, speed: float = 1.0
    ) -> Mapping[str, float]:
        """Let the node measure itself for ten seconds; return its report.

        Args:
            use_node: Called with this time; what the robot does to the node.
        """
        assert self._process.stdin is not None
        seconds = 10.0
        self._process.stdin.write(f'{seconds} {speed}\n')
        self._process.stdin.flush()
        use_node(seconds)
        return self._read_report()

    def _read_report(self) -> dict[str, float]:
        assert self._process.stdout is not None
        while line := self._process.stdout.readline():
            if line.startswith('{'):
                values: dict[str, float] = json.loads(line)
                return values
        raise RuntimeError('the node ended before it reported anything')


def measure_latency_ms(memory: MemoryClient) -> float:
    """Read; return the milliseconds it took beyond the ticks of its physics, of 2 ms each."""
    time.sleep(random.uniform(0.02, 0.06))  # at a random time within a tick
    begun = time.monotonic()
    ticks = memory.request('read').wait().details['ticks']
    return 1e3 * (time.monotonic() - begun) - 2.0 * float(ticks)


def write_levels(memory: MemoryClient, seconds: float) -> None:
    """Write one level after another for some seconds."""
    end, level = time.monotonic() + seconds, 0
    while time.monotonic() < end:
        level = (level + 3) % 8
        memory.request('write', level=level).wait()


def subscribe_streams(memory: MemoryClient) -> None:
    """Subscribe to a node's streams, as long as the client's node lives."""
    from rclpy.qos import qos_profile_sensor_data
    from sensor_msgs.msg import JointState
    from std_msgs.msg import Float32MultiArray, Float64MultiArray

    streams = {'joint_states': JointState, 'field': Float32MultiArray, 'wall': Float64MultiArray}
    for name, kind in streams.items():
        topic = f'{memory.name}/{name}'
        memory.node.create_subscription(kind, topic, lambda _: None, qos_profile_sensor_data)
    time.sleep(1.0)  # they discover each other


def keep_column(rows: Sequence[Mapping[str, str]], file: Path) -> None:
    """Write the figures of this processor to a result file, beside those of others."""
    processor = f'{describe_processor()}, {os.cpu_count()} cores'
    kept = {row['figure']: row for row in load_kept(file).get('rows', ())}
    found = [{'figure': 'date', 'goal': '', processor: date.today().isoformat()}]
    for row in rows:
        found.append({'figure': row['figure'], 'goal': row['goal'], processor: row['value']})
    columns = [{**kept.get(row['figure'], {}), **row} for row in found]
    modules = ['mlmem', 'mlmem_ros', 'lab/mlmem_lab/bench']
    save_result(file, {'rows': columns}, 'mlmem bench node --result FILE', modules)
