# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Writes upward on a bare chain, for the tests of schedules."""

from mlmem_tools.checks.bare import measure_departures


def writes(design, write, starts=None):
    """Yield for every write upward, from all levels or some, whether it succeeds."""
    last = design.levels - 1
    for start in range(last) if starts is None else starts:
        yield from (away < 1.0 for away in measure_departures(design, write, start, last))
