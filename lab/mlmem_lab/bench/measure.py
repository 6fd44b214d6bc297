# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How benchmarks measure: contenders take turns, so that a machine that is fast one second and
slow the next changes no ratio.
"""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mlmem.physics.values import Array


def describe_processor() -> str:
    """Return name, family and model: virtual machines hide the number in the name."""
    first_core, _, _ = Path('/proc/cpuinfo').read_text(encoding='utf-8').partition('\n\n')
    pairs = (line.partition(':') for line in first_core.splitlines())
    known = defaultdict(str, {name.strip(): value.strip() for name, _, value in pairs})
    return f'{known["model name"]} (family {known["cpu family"]}, model {known["model"]})'


@dataclass(frozen=True)
class Contender:
    """One way to do some work: units of work are done by each call."""

    name: str
    call: Callable[[], object]
    work: float


@dataclass(frozen=True)
class ResultTable:
    """What a benchmark found.

    Attributes:
        caption: What is equal for all rows.
        rows: Cells by heading.
    """

    title: str
    caption: str
    rows: Sequence[dict[str, str]]


def measure_contenders(contenders: Sequence[Contender], repeats: int, scale: float) -> Array:
    """Measure contenders side by side.

    Args:
        repeats: Rounds. Every second round goes through the contenders backwards.
        scale: Units of cost in a second: 1e9 reports nanoseconds.

    Returns:
        Cost of a unit of work, shape (contenders, repeats).
    """
    calls = [_count_calls(each) for each in contenders]
    costs = np.empty((len(contenders), repeats))
    for number in range(repeats):
        order = range(len(contenders))
        for i in order if number % 2 == 0 else reversed(order):
            begun = time.perf_counter()
            for _ in range(calls[i]):
                contenders[i].call()
            seconds = time.perf_counter() - begun
            costs[i, number] = scale * seconds / (calls[i] * contenders[i].work)
    return costs


def _count_calls(contender: Contender) -> int:
    """Return how many calls take 0.03 s."""
    contender.call()
    begun = time.perf_counter()
    contender.call()
    return max(1, round(0.03 / max(time.perf_counter() - begun, 1e-9)))


def compare_costs(
    contenders: Sequence[Contender], costs: Array, unit: str
) -> list[dict[str, str]]:
    """Return a row for every contender: its cost, and its ratio to the first, round by round."""
    return [
        {
            'contender': each.name,
            unit: format_spread(own),
            f'over {contenders[0].name}': format_spread(own / costs[0]),
        }
        for each, own in zip(contenders, costs, strict=True)
    ]


def format_spread(samples: Array) -> str:
    """Return the median, and half the distance of the quartiles."""
    low, median, high = np.percentile(samples, (25.0, 50.0, 75.0))
    return f'{format_number(float(median))} ± {0.5 * (high - low):.1g}'


def format_number(number: float) -> str:
    """Return a number with three digits, or whole."""
    return f'{number:.3g}' if abs(number) < 1000.0 else f'{number:.0f}'
