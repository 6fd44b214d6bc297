# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A memory node that watches itself: run by the benchmark `node` as a process of its own.

After its idle time it prints what it saw as one JSON line, and then serves until its standard
input is closed.
"""

from __future__ import annotations

import json
import select
import sys
import time
from pathlib import Path

import numpy as np
import rclpy
from rclpy.executors import SingleThreadedExecutor

from ...device.loop_statistics import LoopStatistics
from ...ros.node import MemoryNode


class Watched(LoopStatistics):
    """Keeps every lateness."""

    def __init__(self) -> None:
        super().__init__()
        self.all: list[float] = []

    def count(self, lateness: float, busy: float) -> None:
        """Take the times of one tick."""
        super().count(lateness, busy)
        self.all.append(lateness)


def main(begun: float, seconds: float) -> None:
    """Run a node idle, print, serve.

    Args:
        begun: When the process was started, in seconds since the epoch.
        seconds: Idle time.
    """
    rclpy.init()
    node = MemoryNode()
    node.trigger_configure()
    node.trigger_activate()
    ready = time.time() - begun
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    _spin(executor, 1.0)
    loop = node.gate.loop
    assert loop is not None
    statistics = loop.statistics = Watched()
    used = time.process_time()
    _spin(executor, seconds)
    used = time.process_time() - used
    late = 1e3 * np.array(statistics.all)
    result = {
        'ready': ready,
        'share': 100.0 * used / seconds,
        'busy': 1e6 * statistics.busy,
        'p50': float(np.percentile(late, 50)),
        'p99': float(np.percentile(late, 99)),
        'overruns': statistics.overruns,
        'memory': _resident(),
    }
    print(json.dumps(result), flush=True)
    while not select.select([sys.stdin], [], [], 0.0)[0]:
        executor.spin_once(timeout_sec=0.1)
    node.close()
    rclpy.shutdown()


def _spin(executor: SingleThreadedExecutor, seconds: float) -> None:
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        executor.spin_once(timeout_sec=0.1)


def _resident() -> float:
    """Return the resident memory in MB."""
    lines = Path('/proc/self/status').read_text(encoding='ascii').splitlines()
    return next(int(line.split()[1]) / 1e3 for line in lines if line.startswith('VmRSS'))


if __name__ == '__main__':
    main(float(sys.argv[1]), float(sys.argv[2]))
