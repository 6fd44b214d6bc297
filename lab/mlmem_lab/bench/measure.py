# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How a benchmark measures, side by side, in turns, repeatedly; what it returns and prints; the
machine that it ran on, and how busy that was otherwise.

A shared machine is fast one second and slow the next. So every round runs all contenders in turn,
and only the ratio of two contenders within a round counts.
"""

from __future__ import annotations

import dataclasses
import os
import platform
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mlmem.physics.potential import Array
from mlmem_ros.packages import find_installed_version

if TYPE_CHECKING:
    from rich.table import Table


def describe_host() -> dict[str, Any]:
    """Return processor, vector units, cores, load and versions."""
    reported_packages = ('mlmem_ros', 'numpy', 'numba', 'llvmlite', 'mcap', 'rosbags', 'rclpy')
    return {
        'processor': describe_processor(),
        'vector_units': [
            unit for unit in ('avx2', 'fma', 'avx512f') if unit in _read_cpu_field('flags')
        ],
        'cores': os.cpu_count(),
        'load': os.getloadavg()[0],
        'system': platform.platform(),
        'python': platform.python_version(),
        'versions': {
            name: version
            for name in reported_packages
            if (version := find_installed_version(name))
        },
    }


def describe_processor() -> str:
    """Return name, family and model: virtual machines hide the number in the name."""
    return (
        f'{_read_cpu_field("model name")} (family {_read_cpu_field("cpu family")}, model '
        f'{_read_cpu_field("model")})'
    )


def _read_cpu_field(key: str) -> str:
    """Return a line of the first core's description; empty if there is none."""
    lines = Path('/proc/cpuinfo').read_text(encoding='utf-8').splitlines()
    pairs = (line.partition(':') for line in lines)
    return next((value.strip() for name, _, value in pairs if name.strip() == key), '')


MAX_OTHER_LOAD_PERCENT = 10.0
"""Share of a core, in percent, that others may take on a quiet machine."""

CLOCK_TICKS_PER_S = os.sysconf('SC_CLK_TCK')


class Load:
    """Measures from its start which share of a core others use.

    That is the time which has passed on all cores, less what they were idle, less our own. The
    kernel measures idle time and that of a process, but samples the other columns of /proc/stat
    at its ticks, at which work that a timer starts is always found.
    """

    def __init__(self, processes: Iterable[int] = ()) -> None:
        """Begin to measure; processes of ours beside this one, by id, must live on."""
        self._ours = [os.getpid(), *processes]
        self._begun = time.monotonic(), self._known()

    def others(self) -> float:
        """Return the share of others since the start, in percent of a core."""
        when, known = self._begun
        seconds = time.monotonic() - when
        return max(0.0, 100.0 * (_count_cores() - (self._known() - known) / seconds))

    def _known(self) -> float:
        """Return the seconds, summed over cores, that were idle or ours."""
        idle_columns = (3, 4)  # columns of /proc/stat in which no work is done: idle and iowait
        idle = sum(int(_read_cpu_lines()[0].split()[1:][column]) for column in idle_columns)
        return idle / CLOCK_TICKS_PER_S + sum(map(read_cpu_seconds, self._ours))


def _read_cpu_lines() -> list[str]:
    """Return the lines of all cores together, and of each, from /proc/stat."""
    lines = Path('/proc/stat').read_text(encoding='ascii').splitlines()
    return [line for line in lines if line.startswith('cpu')]


def _count_cores() -> int:
    return len(_read_cpu_lines()) - 1


def read_cpu_seconds(process: int) -> float:
    """Return the seconds that a process has used, in its code and the system's."""
    fields = Path(f'/proc/{process}/stat').read_text(encoding='utf-8').rpartition(')')[2].split()
    return (int(fields[11]) + int(fields[12])) / CLOCK_TICKS_PER_S


@dataclass(frozen=True)
class Spread:
    """Median and quartiles; printed as the median and half their distance."""

    median: float
    low: float
    high: float

    @classmethod
    def of(cls, samples: Sequence[float] | Array) -> Spread:
        """Return the spread of samples."""
        low, median, high = np.percentile(samples, (25.0, 50.0, 75.0))
        return cls(float(median), float(low), float(high))

    def __str__(self) -> str:
        return f'{_format_number(self.median)} \u00b1 {0.5 * (self.high - self.low):.1g}'


@dataclass(frozen=True)
class Contender:
    """One way to do the work.

    Attributes:
        values: Other numbers to report.
    """

    name: str
    call: Callable[[], object]
    work: float
    values: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Entry:
    """The measurements of one contender.

    Attributes:
        verdict: Whether it reaches its goal, in words; empty without one.
        key: What it is called in a result file; empty for its name.
    """

    name: str
    samples: tuple[float, ...]
    values: dict[str, float] = field(default_factory=dict)
    verdict: str = ''
    key: str = ''

    @property
    def spread(self) -> Spread:
        """Median and quartiles of the cost."""
        return Spread.of(self.samples)

    def over(self, other: Entry) -> Spread:
        """Return the ratio of the costs, round by round: what two runs on one machine share."""
        return Spread.of(np.array(self.samples) / np.array(other.samples))


def measure_contenders(
    contenders: Iterable[Contender],
    repeats: int,
    *,
    scale: float = 1.0,
    clock: Callable[[], float] = time.perf_counter,
) -> list[Entry]:
    """Measure contenders side by side.

    Args:
        repeats: Rounds. Every second round goes through the contenders backwards.
        scale: Units of cost in a second: 1e9 reports nanoseconds.
        clock: The clock that measures cost.

    Returns:
        An entry per contender.
    """
    field_ = list(contenders)
    calls = [_calls_per_sample(each) for each in field_]
    samples: list[list[float]] = [[] for _ in field_]
    for number in range(repeats):
        order = range(len(field_))
        for i in order if number % 2 == 0 else reversed(order):
            begun = clock()
            for _ in range(calls[i]):
                field_[i].call()
            samples[i].append((clock() - begun) / (calls[i] * field_[i].work) * scale)
    return [
        Entry(each.name, tuple(taken), values=each.values)
        for each, taken in zip(field_, samples, strict=True)
    ]


def _calls_per_sample(contender: Contender) -> int:
    contender.call()
    begun = time.perf_counter()
    contender.call()
    seconds = max(time.perf_counter() - begun, 1e-9)
    least_seconds = 0.03  # a sample repeats its call for at least this long
    return max(1, round(least_seconds / seconds))


def _format_number(number: float) -> str:
    return f'{number:.3g}' if abs(number) < 1000 else f'{number:,.0f}'


@dataclass(frozen=True)
class Comparison:
    """Contenders that did the same work, measured side by side.

    Attributes:
        terms: What is equal for all contenders, and what each was given.
        entries: What was measured; ratios are to the first.
        measured: Whether the entries are costs, with a spread and ratios, or plain results.
    """

    name: str
    title: str
    unit: str
    terms: str
    entries: Sequence[Entry]
    skipped: dict[str, str] = field(default_factory=dict)
    measured: bool = True

    def ratio_to_first(self, entry: Entry) -> Spread:
        """Return the cost of an entry over that of the first."""
        return entry.over(self.entries[0])

    def as_dict(self) -> dict[str, Any]:
        """Return everything, every sample included."""
        values = {**dataclasses.asdict(self), 'host': describe_host()}
        if self.measured:
            values['ratios'] = [
                dataclasses.asdict(self.ratio_to_first(entry)) for entry in self.entries
            ]
        return values

    def rows(self) -> list[dict[str, str]]:
        """Return the table as a row for every entry, by heading."""
        return [self._cells(entry) for entry in self.entries]

    def table(self) -> Table:
        """Return the comparison as a table for a terminal."""
        from rich.table import Table

        rows = self.rows()
        headings = list(dict.fromkeys(heading for row in rows for heading in row))
        table = Table(title=self.title, title_justify='left', caption=self._format_caption())
        table.caption_justify = 'left'
        for heading in headings:
            table.add_column(heading, justify='left' if heading == 'contender' else 'right')
        for row in rows:
            table.add_row(*(row.get(heading, '') for heading in headings))
        return table

    def _cells(self, entry: Entry) -> dict[str, str]:
        """Return what the table says of an entry, by heading."""
        cells = {'contender': entry.name}
        if self.measured:
            cells[self.unit] = str(entry.spread)
            cells[f'over {self.entries[0].name}'] = str(self.ratio_to_first(entry))
        else:
            cells[self.unit] = f'{entry.spread.median:.3g}'
        cells |= {key: f'{value:.3g}' for key, value in entry.values.items()}
        return cells | ({'goal': entry.verdict} if entry.verdict else {})

    def _format_caption(self) -> str:
        lines = [self.terms]
        if self.measured:
            lines.append('median, half the quartile distance; ratios are taken within a round')
        return '\n'.join(lines + [f'{who} skipped: {why}' for who, why in self.skipped.items()])
