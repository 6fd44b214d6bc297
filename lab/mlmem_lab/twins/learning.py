# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Planned pulses beside learnt ones, on the same elements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mlmem_ros.device import Calibrate, Erase, MemoryElement, Write

from ..reads.count import true_level
from .sensed import device, fitted, foretell, made, performed

WAYS = ('learnt', 'planned')
"""How pulses are found: by trial, or on the twin."""

WRITES = 20
"""Writes of random levels after a calibration."""


def compared(preset: str, scatter: float, seed: int) -> dict[str, Any]:
    """Return how the same element does with pulses that are learnt, and with planned ones.

    Returns:
        By way: whether the calibration succeeded and its time; of `WRITES` verified writes how
        many failed and how many named another level than the true one; their mean time.
    """
    specimen, found = made(preset, scatter, seed), dict[str, Any](seed=seed)
    for way in WAYS:
        element = device(preset, specimen)
        if way == 'planned':
            foretell(preset, element, fitted(specimen, seed))
        outcome, _ = performed(element, Calibrate())
        time = element.ticks * element.tick
        found[way] = {'calibrated': outcome.success, 'time': time} | _writes(element, seed)
    return found


def _writes(element: MemoryElement, seed: int) -> dict[str, Any]:
    random = np.random.default_rng(seed)
    performed(element, Erase())
    failed, wrong, begun = 0, 0, element.ticks
    for level in random.integers(element.design.levels, size=WRITES):
        outcome, _ = performed(element, Write(int(level)))
        failed += not outcome.success
        wrong += int(outcome.success and true_level(element) != level)
    spent = (element.ticks - begun) * element.tick / WRITES
    return {'failed': failed, 'wrong': wrong, 'time per write': spent}


def summary(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return the totals of either way, and the seeds of elements on which one alone succeeds."""
    found: dict[str, Any] = {'elements': len(rows), 'writes': WRITES * len(rows)}
    good = {way: {row['seed'] for row in rows if _succeeds(row[way])} for way in WAYS}
    for way, other in (WAYS, WAYS[::-1]):
        found[way] = {
            'calibrated': sum(row[way]['calibrated'] for row in rows),
            'failed': sum(row[way]['failed'] for row in rows),
            'wrong': sum(row[way]['wrong'] for row in rows),
            'time': float(np.median([row[way]['time'] for row in rows])),
            'most time': max(row[way]['time'] for row in rows),
            'time per write': float(np.mean([row[way]['time per write'] for row in rows])),
            'alone': sorted(good[way] - good[other]),
        }
    return found


def _succeeds(done: Mapping[str, Any]) -> bool:
    return bool(done['calibrated'] and not done['failed'])
