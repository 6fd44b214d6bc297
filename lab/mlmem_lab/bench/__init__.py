# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Benchmarks, one per module, whose `run(repeats)` returns a `ResultTable`."""

BENCHMARK_TITLES = {
    'kernel': 'ns per site and stage compared with C',
    'recorder': 'recording as fast as possible',
    'node': 'share of a core, tick lateness, read latency, start-up time and memory',
}
"""What is measured, by module, in the order they run."""
