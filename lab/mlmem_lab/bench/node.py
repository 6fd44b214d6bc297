# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The node at its defaults: share of a core, tick lateness, read latency, start, memory.

Requests come from another process. The time of a read beyond the ticks that the material needs is
the latency of client, transport, command and loop; a request that is refused at once shows client
and transport alone.

Beside each figure stands which share of a core others took while it was measured. On a machine
that was not quiet no figure is called good.
"""

from __future__ import annotations

import asyncio
import os
import random
import statistics
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from datetime import date
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from mlmem_ros.contract.services import load_action_types

from ..results import load_kept, save_result
from .measure import MAX_OTHER_LOAD_PERCENT, Comparison, Entry, Spread, describe_host
from .node_process import (
    NodeProcess,
    measure_overhead_ms,
    watch_streams,
    write,
)

TITLE = 'share of a core, tick lateness, read latency, start-up time and memory'


IDLE_TIME_S = 10.0
"""Idle time per repeat."""

BANK_ELEMENTS = 4
"""Elements of a bank."""

LARGE_BANK_ELEMENTS = 100
"""Elements of a large bank, which is measured once: it takes a minute to start."""


class Figure(NamedTuple):
    """What is measured: its name, and the goal: at most, or with `least` at least this."""

    name: str
    goal: float | None = None
    least: bool = False

    def verdict(self, value: float, others: float) -> str:
        """Return whether the goal is reached; only on a quiet machine it can be."""
        if self.goal is None:
            return ''
        if (value >= self.goal) if self.least else (value <= self.goal):
            return (
                'good' if others <= MAX_OTHER_LOAD_PERCENT else 'not judged: the machine was busy'
            )
        return f'above {self.goal:g}' if not self.least else f'below {self.goal:g}'

    def describe_goal(self) -> str:
        """Return the goal; empty without one."""
        if self.goal is None:
            return ''
        return f'at {"least" if self.least else "most"} {self.goal:g}'


MEASURED_FIGURES = {
    'share': Figure('processor at rest, nobody listens, % of a core', 1.0),
    'heard': Figure('processor at rest, somebody listens to the streams, % of a core', 3.0),
    'shaken': Figure('processor, streams listened to, an IMU of 200 Hz, % of a core'),
    'lost': Figure('ticks skipped with the IMU', 0.0),
    'writing': Figure('processor, one write after another, % of a core', 6.0),
    'busy': Figure('work per tick while writing, us', 60.0),
    'factor': Figure('speed at rest, as fast as possible, times real time', 1000.0, least=True),
    'p50': Figure('tick lateness p50, ms'),
    'p99': Figure('tick lateness p99, ms', 1.0),
    'worst': Figure('tick lateness, maximum, ms'),
    'overruns': Figure('ticks skipped', 0.0),
    'seen': Figure('processor, a page is open, % of a core'),
    'seen_p50': Figure('tick lateness p50 with a page, ms'),
    'seen_p99': Figure('tick lateness p99 with a page, ms'),
    'latency': Figure('read latency beyond the physics, p50, ms', 1.0),
    'transport': Figure('latency of a refused request, p50, ms'),
    'ready': Figure('start-up time, warm cache, s', 1.0),
    'cold': Figure('start-up time, cold cache, s'),
    'memory': Figure('memory, MB'),
    'bank': Figure(
        f'processor, {BANK_ELEMENTS} elements at rest in one process, % of a core', 12.0
    ),
    'bank_memory': Figure(f'memory of {BANK_ELEMENTS} elements, MB', 400.0),
    'hundred': Figure(f'processor, {LARGE_BANK_ELEMENTS} elements at rest, % of a core', 15.0),
    'hundred_memory': Figure(f'memory of {LARGE_BANK_ELEMENTS} elements, MB', 1000.0),
    'hundred_ready': Figure(f'start-up time of {LARGE_BANK_ELEMENTS} elements, s'),
}

Seen = dict[str, tuple[float, float]]
"""By key of a figure: its value, and the share of others in percent of a core."""


def run(repeats: int) -> list[Comparison]:
    """Start nodes one after another and collect their reports.

    There are half as many nodes as repeats, and at least three.
    """
    found = _collect_reports(max(3, repeats // 2))
    terms = (
        f'{len(found) - 1} nodes, each idle for {IDLE_TIME_S:g} s, then used; others: share of a '
        f'core that others took meanwhile, in percent, of which {MAX_OTHER_LOAD_PERCENT:g} are '
        f'quiet'
    )
    entries = [
        _build_entry(key, [each[key] for each in found if key in each]) for key in MEASURED_FIGURES
    ]
    title = 'The node at its defaults'
    return [Comparison('node', title, 'value', terms, entries, measured=False)]


def _build_entry(key: str, seen: list[tuple[float, float]]) -> Entry:
    """Return the samples of a figure, with the load and the verdict."""
    samples, loads = zip(*seen, strict=True)
    figure, others = MEASURED_FIGURES[key], max(loads)
    verdict = figure.verdict(Spread.of(samples).median, others)
    return Entry(figure.name, samples, values={'others': others}, verdict=verdict, key=key)


def _collect_reports(repeats: int) -> list[Seen]:
    from mlmem_ros.ros.client.client import standalone

    os.environ['ROS_DOMAIN_ID'] = str(random.randint(1, 100))
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    found: list[Seen] = []
    with tempfile.TemporaryDirectory() as cache, NodeProcess(NUMBA_CACHE_DIR=cache) as cold:
        found.append({'cold': (cold.ready, cold.others)})
    # seconds after the start in which nothing is measured: discovery is under way
    settle_time_s = 5.0
    with NodeProcess(LARGE_BANK_ELEMENTS) as bank:
        bank.watch(settle_time_s)
        report = bank.watch(IDLE_TIME_S)
    found[0] |= _extract_figures(report, hundred='share', hundred_memory='memory')
    found[0]['hundred_ready'] = bank.ready, bank.others
    reads_per_repeat = 15
    for _ in range(repeats):
        with NodeProcess() as node:
            node.watch(settle_time_s)
            seen: Seen = {'ready': (node.ready, node.others)}
            seen |= _extract_figures(
                node.watch(IDLE_TIME_S), 'share', 'p50', 'p99', 'worst', 'overruns', 'memory'
            )
            seen |= _extract_figures(node.watch(IDLE_TIME_S, speed=0.0), 'factor')
            seen |= _extract_figures(watch_streams(node, IDLE_TIME_S, shaken=False), heard='share')
            seen |= _extract_figures(
                watch_streams(node, IDLE_TIME_S, shaken=True), shaken='share', lost='overruns'
            )
            with standalone() as memory:
                memory.ready().wait()
                report = node.watch(IDLE_TIME_S, partial(write, memory))
                seen |= _extract_figures(report, 'busy', writing='share')
                read = partial(memory.request, 'read')
                asked: dict[str, Callable[[], Any]] = {
                    'transport': memory.step,
                    'latency': read,
                }
                load = node.load()
                taken = [
                    [measure_overhead_ms(ask) for ask in asked.values()]
                    for _ in range(reads_per_repeat)
                ]
                for key, each in zip(asked, zip(*taken, strict=True), strict=True):  # by turns
                    seen[key] = statistics.median(each), load.others()
            with open_page('mlmem'):
                node.watch(settle_time_s)
                page = node.watch(IDLE_TIME_S)
            seen |= _extract_figures(page, seen='share', seen_p50='p50', seen_p99='p99')
        with NodeProcess(BANK_ELEMENTS) as bank:
            bank.watch(settle_time_s)
            four = bank.watch(IDLE_TIME_S)
        found.append(seen | _extract_figures(four, bank='share', bank_memory='memory'))
    return found


def _extract_figures(report: dict[str, float], *keys: str, **names: str) -> Seen:
    """Return figures of a report, some under other names, with the load."""
    return {key: (report[name], report['others']) for key, name in
            [*zip(keys, keys, strict=True), *names.items()]}  # fmt: skip


def keep_column(comparison: Comparison, file: Path) -> None:
    """Write the figures of this processor to a result file, beside those of others that it has;
    whether the nodes serve actions says much about a bank.
    """
    host = describe_host()
    processor = f'{host["processor"]}, {host["cores"]} cores'
    kept = {row['figure']: row for row in load_kept(file).get('rows', ())}
    about = {'date': date.today().isoformat(), 'actions': 'yes' if load_action_types() else 'no'}
    found = {name: ('', value) for name, value in about.items()} | {
        entry.name: (MEASURED_FIGURES[entry.key].describe_goal(), _format_cell(entry))
        for entry in comparison.entries
    }
    rows = {
        name: {**kept.get(name, {'figure': name, 'goal': goal}), processor: value}
        for name, (goal, value) in found.items()
    }
    rows |= {name: row for name, row in kept.items() if name not in rows}
    modules = ['mlmem_ros', 'lab/mlmem_lab/bench']
    save_result(file, {'rows': list(rows.values())}, 'mlmem bench node --result FILE', modules)


def _format_cell(entry: Entry) -> str:
    """Return a figure, and whether the machine was too busy for it."""
    value = entry.spread.median
    short = f'{value:.3g}' if abs(value) < 1000.0 else f'{value:.0f}'
    return short if entry.values['others'] <= MAX_OTHER_LOAD_PERCENT else f'{short} (busy)'


@contextmanager
def open_page(node: str) -> Iterator[None]:
    """Keep a page open."""
    command = [sys.executable, '-m', 'mlmem_tools.cli.main', 'view', '--port', '0', '--node', node]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    address = process.stdout.readline().split()[-1].rstrip('/')
    reader = threading.Thread(target=lambda: asyncio.run(_take_pictures(address)), daemon=True)
    reader.start()
    try:
        yield
    finally:
        process.terminate()
        process.wait(10.0)
        reader.join(10.0)


async def _take_pictures(address: str) -> None:
    """Take pictures until the server ends."""
    import aiohttp

    with suppress(aiohttp.ClientError):
        async with (
            aiohttp.ClientSession() as client,
            client.ws_connect(f'{address}/live', headers={'Origin': address}) as socket,
        ):
            async for _ in socket:
                pass
