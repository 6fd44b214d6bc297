# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The node at its defaults: share of a core, tick lateness, read latency, start, memory.

Requests come from another process. The time of a read beyond the ticks that the material needs is
the latency of client, transport, command and loop; a request that is refused at once shows client
and transport alone.
"""

from __future__ import annotations

import os
import random
import statistics
import tempfile
from functools import partial

from .comparison import Comparison
from .measure import Entry
from .node_process import NodeProcess, beyond, listen, write
from .open_page import open_page

TITLE = 'share of a core, tick lateness, read latency, start-up time and memory'

SETTLED = 5.0
"""Seconds after the start in which nothing is measured: discovery is under way."""

SECONDS = 10.0
"""Idle time per repeat."""

BANK = 4
"""Elements of a bank."""

READS = 15
"""Reads per repeat."""

NAMES = {
    'share': 'processor, nobody listens, % of a core',
    'heard': 'processor, somebody listens to the streams, % of a core',
    'shaken': 'processor, the same with an IMU of 200 Hz, % of a core',
    'lost': 'ticks skipped with the IMU',
    'writing': 'processor, one write after another, % of a core',
    'seen': 'processor, a page is open, % of a core',
    'busy': 'work per tick, us',
    'p50': 'tick lateness p50, ms',
    'p99': 'tick lateness p99, ms',
    'worst': 'tick lateness, maximum, ms',
    'seen_p50': 'tick lateness p50 with a page, ms',
    'seen_p99': 'tick lateness p99 with a page, ms',
    'overruns': 'ticks skipped',
    'latency': 'read latency beyond the physics, p50, ms',
    'transport': 'a refused request, p50, ms',
    'ready': 'start-up time, warm cache, s',
    'cold': 'start-up time, cold cache, s',
    'memory': 'memory, MB',
    'bank': f'processor, {BANK} elements in one process, nobody listens, % of a core',
    'bank_memory': 'memory of these, MB',
}


def run(repeats: int) -> list[Comparison]:
    """Start nodes one after another and collect their reports.

    Args:
        repeats: Twice the number of nodes.
    """
    found = _reports(max(3, repeats // 2))
    terms = f'{len(found) - 1} nodes, each idle for {SECONDS:g} s, then used'
    entries = [
        Entry(name, tuple(each[key] for each in found if key in each))
        for key, name in NAMES.items()
    ]
    title = 'The node at its defaults'
    return [Comparison('node', title, 'value', terms, entries, measured=False)]


def _reports(repeats: int) -> list[dict[str, float]]:
    from ..ros.client.standalone import standalone

    os.environ['ROS_DOMAIN_ID'] = str(random.randint(1, 100))
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    found = []
    with tempfile.TemporaryDirectory() as cache, NodeProcess(NUMBA_CACHE_DIR=cache) as cold:
        found.append({'cold': cold.ready})
    for _ in range(repeats):
        with NodeProcess() as node:
            node.watch(SETTLED)
            seen = {'ready': node.ready, **node.watch(SECONDS)}
            seen['heard'] = listen(node, SECONDS, shaken=False)['share']
            shaken = listen(node, SECONDS, shaken=True)
            seen |= {'shaken': shaken['share'], 'lost': shaken['overruns']}
            with standalone() as memory:
                memory.ready().wait()
                seen['writing'] = node.watch(SECONDS, partial(write, memory))['share']
                read = partial(memory.request, 'read')
                for key, ask in (('transport', memory.step), ('latency', read)):
                    seen[key] = statistics.median(beyond(ask) for _ in range(READS))
            with open_page('mlmem'):
                node.watch(SETTLED)
                page = node.watch(SECONDS)
            seen |= {'seen': page['share'], 'seen_p50': page['p50'], 'seen_p99': page['p99']}
        with NodeProcess(BANK) as bank:
            bank.watch(SETTLED)
            four = bank.watch(SECONDS)
        found.append({**seen, 'bank': four['share'], 'bank_memory': four['memory']})
    return found
