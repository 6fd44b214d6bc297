# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the rules of reading make of echoes that lie between those of a preset's levels."""

from __future__ import annotations

import numpy as np

from mlmem_ros.device import preset
from mlmem_ros.device.calibration import DelayTable
from mlmem_ros.device.decoding import decode
from mlmem_ros.device.echo import SHARES, Echo, threshold
from mlmem_ros.device.end import End
from mlmem_ros.device.factory import factory_calibration
from mlmem_ros.device.settings import ProbeSettings

ECHOES = 400
"""Pairs of echoes."""

AWAY = 0.3
"""How far a crossing is from that of its level, as a share of the spacing: standard deviation."""

PHASES = (1, 0)
"""Of the ends of an element that stores a level."""


def decisions(name: str) -> list[tuple[int, float]]:
    """Return level and level margin of drawn pairs of echoes of a preset, the same ones each time.

    Every crossing of either echo is moved by itself and with the others, and the echo is made
    louder or fainter, on a floor of noise or none. So a rule that is added, or a limit that is
    moved, changes what some of them say.
    """
    given = preset(name)
    calibration = factory_calibration(given.design, given.settings)
    random = np.random.Generator(np.random.PCG64(1))
    said = []
    for _ in range(ECHOES):
        level = int(random.integers(given.design.levels))
        floor = float(random.choice([0.0, 0.3])) * given.settings.probe.v_th
        echoes = {}
        for end in calibration.ends:
            probe = end.probe(given.settings)
            echoes[end] = _drawn(random, end, probe, calibration.table(end), level, floor)
        reading = decode(given.design, given.settings.read, calibration, echoes, PHASES)
        said.append((reading.level, round(reading.level_margin, 6)))
    return said


def _drawn(
    random: np.random.Generator,
    end: End,
    probe: ProbeSettings,
    table: DelayTable,
    level: int,
    floor: float,
) -> Echo:
    """Return an echo that crosses shares of the threshold near the times of a level."""
    delay = table.delays[level]
    low, high, loud = table.shapes[level] if table.shapes else (None, None, 2.0)
    spacing = abs(float(np.median(np.diff(table.delays)))) if table.delays[1:] else delay
    known = [delay - 5.0 if low is None else low, delay, delay + 5.0 if high is None else high]
    shifted = np.array(known) + AWAY * spacing * (random.normal() + 0.5 * random.normal(size=3))
    times = np.sort(np.append(shifted, shifted.max() + 20.0))
    loud *= float(random.uniform(0.7, 1.5))
    t = np.arange(0.0, times[-1] + 50.0, 0.5)
    ratio = np.interp(t, times, [SHARES[0], 1.0, SHARES[1], max(loud, SHARES[1])], left=0.0)
    v_c = ratio * threshold(probe, t, floor)
    return Echo(end, probe, t, v_c, v_c, float(times[1]), max(loud, SHARES[1]), floor)
