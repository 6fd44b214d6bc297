# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Benchmarks, one per module: `TITLE` and `run(repeats)`, which returns a `ResultTable`."""

BENCHMARK_NAMES = ('kernel', 'recorder', 'node')
"""The modules, in the order they run."""
