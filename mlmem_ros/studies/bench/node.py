# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The node at its defaults: share of a core, tick lateness, read latency, start, memory.

Reads go through the service, from another process. What a read takes beyond the ticks that the
material needs is the latency of command, loop and transport; half a tick of it is the wait for
the next tick.
"""

from __future__ import annotations

import json
import os
import random
import statistics
import subprocess
import sys
import tempfile
import time
from typing import Any

from .comparison import Comparison
from .measure import Entry

TITLE = 'share of a core, tick lateness, read latency, start-up time and memory'

SECONDS = 10.0
"""Idle time per repeat."""

READS = 5
"""Reads per repeat."""

NAMES = {
    'share': 'processor, % of a core',
    'busy': 'work per tick, us',
    'p50': 'tick lateness p50, ms',
    'p99': 'tick lateness p99, ms',
    'overruns': 'ticks skipped',
    'latency': 'read latency beyond the physics, ms',
    'ready': 'ready after, warm cache, s',
    'cold': 'ready after, cold cache, s',
    'memory': 'memory, MB',
}


def run(repeats: int) -> list[Comparison]:
    """Start nodes one after the other and collect what they tell."""
    import rclpy
    from std_srvs.srv import Trigger

    os.environ['ROS_DOMAIN_ID'] = str(random.randint(1, 100))
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    rclpy.init()
    reader = rclpy.create_node('reader')
    service = reader.create_client(Trigger, '/mlmem/read')
    with tempfile.TemporaryDirectory() as cache:
        cold = _one_node(1.0, NUMBA_CACHE_DIR=cache)['ready']
    found: list[dict[str, Any]] = []
    for _ in range(max(3, repeats // 2)):
        found.append(_one_node(SECONDS, during=lambda: _latency(reader, service)))
    rclpy.shutdown()
    entries = []
    for key, name in NAMES.items():
        samples = [cold] if key == 'cold' else [each[key] for each in found]
        entries.append(Entry(name, tuple(samples)))
    return [
        Comparison(
            'node',
            'The node at its defaults',
            'value',
            f'{len(found)} nodes, each idle for {SECONDS:g} s, then read {READS} times',
            entries,
            measured=False,
        )
    ]


def _one_node(seconds: float, during: Any = None, **environment: str) -> dict[str, Any]:
    command = [sys.executable, '-m', f'{__package__}.node_probe', str(time.time()), str(seconds)]
    process = subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        stderr=subprocess.DEVNULL, env=os.environ | environment,
    )  # fmt: skip
    with process:
        assert process.stdout is not None
        line = ''
        while not line.startswith('{'):
            line = process.stdout.readline()
            if not line:
                raise RuntimeError('the node ended before it told anything')
        found: dict[str, Any] = json.loads(line)
        if during is not None:
            found['latency'] = during()
    return found


def _latency(reader: Any, service: Any) -> float:
    """Return the median time of a read beyond its ticks, in milliseconds."""
    import rclpy
    from std_srvs.srv import Trigger

    assert service.wait_for_service(10.0)
    beyond: list[float] = []
    for _ in range(READS):
        begun = time.monotonic()
        future = service.call_async(Trigger.Request())
        rclpy.spin_until_future_complete(reader, future, timeout_sec=20.0)
        taken = time.monotonic() - begun
        answer = json.loads(future.result().message)
        beyond.append(1e3 * taken - 2.0 * answer['ticks'])
    return statistics.median(beyond)
