# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Benchmarks, one per file: `TITLE` and `run(repeats)`, which returns comparisons."""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from types import ModuleType

BENCHMARK_NAMES = ('kernel', 'recorder', 'node')
"""Those modules of this package, in the order they run."""


def import_benchmark(name: str) -> ModuleType:
    """Import a benchmark."""
    return importlib.import_module(f'.{name}', __name__)


def select_benchmarks(names: Sequence[str]) -> list[str]:
    """Return the named benchmarks, or all without a name.

    Raises:
        KeyError: There is no such benchmark; the message lists them.
    """
    for name in names:
        if name not in BENCHMARK_NAMES:
            raise KeyError(f'benchmark must be one of {", ".join(BENCHMARK_NAMES)}; got {name!r}')
    return [name for name in BENCHMARK_NAMES if not names or name in names]
