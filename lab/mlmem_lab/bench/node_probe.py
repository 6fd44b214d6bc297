# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A memory node that measures itself: the process that the benchmark `node` starts.

It prints one JSON line when it is ready. For every line that it reads, seconds and a speed, it
measures itself and prints the result as another line. It serves requests all the time, until its
standard input is closed.
"""

from __future__ import annotations

import gc
import json
import os
import select
import sys
import time
from array import array
from pathlib import Path

import numpy as np

from mlmem.loop.timetable import LoopStatistics
from mlmem_ros.ros.node.node import MemoryNode
from mlmem_ros.ros.node.run import GuardedExecutor, end_nodes, start_nodes
from mlmem_ros.ros.node_process import use_profile


class LatenessRecord(LoopStatistics):
    """Statistics that keep every lateness."""

    def __init__(self) -> None:
        super().__init__()
        self._lateness, self._ticks = array('f'), array('q')

    def count(self, lateness: float, busy: float, ticks: int = 1) -> None:
        """Take the times of equal ticks."""
        super().count(lateness, busy, ticks)
        self._lateness.append(lateness)
        self._ticks.append(ticks)

    def compute_p99_ms(self) -> float:
        """Return the lateness that 99 of 100 ticks do not exceed, in ms."""
        late = np.array(self._lateness)
        order = np.argsort(late)
        done = np.cumsum(np.array(self._ticks)[order])
        return 1e3 * float(late[order][np.searchsorted(done, 0.99 * done[-1])])


def main(begun: float) -> None:
    """Run a node, print, serve.

    Args:
        begun: When the process was started, in seconds since the epoch.
    """
    use_profile(os.environ)
    nodes, executor = start_nodes([])
    gc.freeze()
    _print_values({'ready': time.time() - begun})
    while True:
        executor.turn(0.1)
        if select.select([sys.stdin], [], [], 0.0)[0]:
            if not (line := sys.stdin.readline()):
                break
            seconds, speed = map(float, line.split())
            _print_values(_watch_node(nodes[0], executor, seconds, speed))
    end_nodes(nodes, executor)


def _watch_node(
    node: MemoryNode, executor: GuardedExecutor, seconds: float, speed: float
) -> dict[str, float]:
    """Return measurements of the process, and of the ticks of its node."""
    loop = node.host.open_loop()
    statistics, own = LatenessRecord(), loop.statistics
    node.host.set_speed(speed)

    def count(lateness: float, busy: float, ticks: int = 1) -> None:
        LoopStatistics.count(own, lateness, busy, ticks)
        statistics.count(lateness, busy, ticks)

    def begin_watch() -> None:
        vars(own)['count'] = count
        statistics.overruns = -own.overruns

    loop.call(begin_watch).result()  # between two ticks; those of a rest before are done
    used, begun = time.process_time(), time.monotonic()
    while (now := time.monotonic()) - begun < seconds:
        executor.turn(begun + seconds - now)
    used = time.process_time() - used
    node.host.set_speed(1.0)
    loop.call(lambda: vars(own).pop('count')).result()
    statistics.overruns += own.overruns
    return {
        'share': 100.0 * used / (now - begun),
        'busy': 1e6 * statistics.busy,
        'p99': statistics.compute_p99_ms(),
        'factor': statistics.ticks * loop.element.settings.tick_seconds / (now - begun),
        'overruns': statistics.overruns,
        'memory': _read_resident_mb(),
    }


def _print_values(values: dict[str, float]) -> None:
    print(json.dumps(values), flush=True)


def _read_resident_mb() -> float:
    """Return the resident memory in MB."""
    lines = Path('/proc/self/status').read_text(encoding='ascii').splitlines()
    return next(int(line.split()[1]) / 1e3 for line in lines if line.startswith('VmRSS'))


if __name__ == '__main__':
    main(float(sys.argv[1]))
