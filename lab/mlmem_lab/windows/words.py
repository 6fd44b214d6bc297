# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Measure how exact the kicks of a register must be.

A wall or a kink is sent to every level, as shipped and faster or slower, with nothing ahead, with
the next ones as near as they may rest, and with one at the last level. The room of a level is the
least relative change of the speed that leads elsewhere, or moves what rests already.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from mlmem import preset
from mlmem.physics import Specimen
from mlmem_tools.identification.kick_search import build_chain, find_speed_edge
from mlmem_tools.identification.register_plan import STEP_KINDS, cases_ahead, kicked_behind

from ..study import Study


def measure_windows(name: str) -> list[dict[str, Any]]:
    """Return the window of every kick of a register."""
    design, settings = preset(name)
    chain = build_chain(Specimen(design), settings)
    found = []
    for kind, speeds in enumerate((settings.kick.wall_speeds, settings.kick.kink_speeds)):
        for level in range(design.levels):
            cases = cases_ahead(design.levels, settings.register.spacing, level, kind)

            def is_good_speed(
                speed: float, cases: Sequence[Any] = cases, level: int = level
            ) -> bool:
                return all(
                    kicked_behind(chain, settings.kick, each, speed) == (level, *each)
                    for each in cases
                )

            speed = speeds[level]
            if not cases:
                continue
            low, high = speed, speed
            if right := is_good_speed(speed):
                low, high = (
                    find_speed_edge(is_good_speed, speed, step) for step in (1.0 / 1.04, 1.04)
                )
            found.append({
                'kind': STEP_KINDS[kind], 'level': level, 'speed': speed, 'right': right,
                'low': round(low, 5), 'high': round(high, 5), 'cases': len(cases),
                'room': round(min(speed / low, high / speed) - 1.0, 3),
            })  # fmt: skip
    return found


def measure_preset(name: str) -> dict[str, Any]:
    """Return the windows of a register as its result file has them."""
    return {'kicks': measure_windows(name)}


STUDY = Study(
    'word_kicks',
    measure_preset,
    ('byte',),
    ('lab/mlmem_lab/windows/words.py', 'mlmem_tools/identification/kick_search.py'),
)
