# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Memory nodes that measure themselves: the process that the benchmark `node` starts.

It prints one JSON line when it is ready. For every number that it reads it measures itself for so
many seconds, and prints the result as another line. It serves requests all the time, until its
standard input is closed.
"""

from __future__ import annotations

import gc
import json
import select
import sys
import time
from array import array
from pathlib import Path

import numpy as np

from ..device.loop_statistics import LoopStatistics
from ..ros.node.command_line import bank_arguments
from ..ros.node.executor import GuardedExecutor
from ..ros.node.node import MemoryNode
from ..ros.node.run import ONE, begin, end


class Watched(LoopStatistics):
    """Keeps every lateness."""

    def __init__(self) -> None:
        super().__init__()
        self.all = array('f')

    def count(self, lateness: float, busy: float, ticks: int = 1) -> None:
        """Take the times of equal ticks."""
        super().count(lateness, busy, ticks)
        self.all.extend([lateness] * ticks)


def main(begun: float, number: int) -> None:
    """Run nodes, print, serve.

    Args:
        begun: When the process was started, in seconds since the epoch.
        number: How many; above 1 they are those of `memory_bank`.
    """
    bank = bank_arguments(['memory_bank', f'--elements={number}'])[1]
    nodes, executor = begin([], elements=bank if number > 1 else ONE)
    gc.freeze()
    _tell({'ready': time.time() - begun})
    while True:
        executor.turn(0.1)
        if select.select([sys.stdin], [], [], 0.0)[0]:
            if not (line := sys.stdin.readline()):
                break
            _tell(_watch(nodes[0], executor, float(line)))
    end(nodes, executor)


def _watch(node: MemoryNode, executor: GuardedExecutor, seconds: float) -> dict[str, float]:
    """Return measurements of the process, and of the ticks of its first node."""
    loop = node.host.open_loop()
    statistics = loop.statistics = Watched()
    used, begun = time.process_time(), time.monotonic()
    while (now := time.monotonic()) - begun < seconds:
        executor.turn(begun + seconds - now)
    used = time.process_time() - used
    late = 1e3 * np.array(statistics.all)
    p50, p99 = np.percentile(late, (50.0, 99.0))
    return {
        'share': 100.0 * used / (now - begun),
        'busy': 1e6 * statistics.busy,
        'p50': float(p50),
        'p99': float(p99),
        'worst': float(late.max()),
        'ticks': statistics.ticks,
        'overruns': statistics.overruns,
        'memory': _resident(),
    }


def _tell(values: dict[str, float]) -> None:
    print(json.dumps(values), flush=True)


def _resident() -> float:
    """Return the resident memory in MB."""
    lines = Path('/proc/self/status').read_text(encoding='ascii').splitlines()
    return next(int(line.split()[1]) / 1e3 for line in lines if line.startswith('VmRSS'))


if __name__ == '__main__':
    main(float(sys.argv[1]), int(sys.argv[2]))
