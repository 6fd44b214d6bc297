# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One point of a map: every level written in turn with its settings."""

from __future__ import annotations

import math
from dataclasses import replace

from mlmem_ros.device import SettingsError

from ..bench import Bench
from ..campaign import Row
from ..campaign.campaign import Values
from ..climb import Climb, Heat, least_margins, write_upward
from .axes import with_values

UNFIT = 'unfit'
"""Failure of settings that give no device: no echo, or out of range."""


def rerun(shared: Values, values: Values, seed: int) -> Climb:
    """Return the climb of one point.

    For what all points share see `Shmoo.campaign`.

    Raises:
        SettingsError: These settings give no device.
    """
    bench = Bench.of(shared)
    settings, temperature = with_values(bench.settings, values)
    bench = replace(bench, settings=settings)
    element = bench.device()
    heat = Heat(element, temperature, seed) if temperature else None
    return write_upward(element, heat, bench.level)


def evaluate(shared: Values, values: Values, seed: int) -> Row:
    """Return the results of one point, as numbers and words.

    Returns:
        passed: Whether every level was written and read back.
        reached: How many were, from level 0 up.
        failure: '' or the reason: see `WrittenLevel.failure`, and `UNFIT`.
        error: What the device said.
        wall: True position of the wall at the end, None for none or several.
        level_margin, threshold_margin: The least of all readings, None without one.
        time: Time units from the first write to the end of the last.
    """
    try:
        climb = rerun(shared, values, seed)
    except SettingsError as error:
        return {
            'passed': False, 'reached': 0, 'failure': UNFIT, 'error': str(error), 'wall': None,
            'level_margin': None, 'threshold_margin': None, 'time': 0.0,
        }  # fmt: skip
    last = climb.writes[-1]
    return {
        'passed': climb.passed, 'reached': climb.reached, 'failure': climb.failure,
        'error': last.outcome.error, 'wall': last.wall if math.isfinite(last.wall) else None,
        **least_margins(each.outcome for each in climb.writes),
        'time': last.outcome.end_tick * shared['settings']['time']['tick'],
    }  # fmt: skip
