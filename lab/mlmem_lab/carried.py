# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How far a kick carries: levels of a long element, and how exact their speeds must be.

python3 -m mlmem_lab.carried [PRESET ...] makes lab/results/carried.json.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from typing import Any

from mlmem_ros.device.presets import preset
from mlmem_ros.physics import Specimen

from .results import run
from .windows.flight import ENOUGH, bare, search_kicks

MODULES = ('lab/mlmem_lab/windows',)

DAMPINGS = (250, 200, 168)
"""Damping times 1 / eta that are tried."""


def carried(name: str) -> dict[str, Any]:
    """Return the speed and room of every level that a kick reaches, by damping time; the farthest
    level, and up to which all bear enough.
    """
    design, settings = preset(name)
    shape, found = preset('kick_4').settings.kick, {}
    for time in DAMPINGS:
        chain = bare(Specimen(replace(design, eta=1.0 / time)), settings)
        kicks = search_kicks(chain, shape, settings.transducer.max_speed)
        wide = [each.room >= ENOUGH for each in kicks]
        found[str(time)] = {
            'reached': max(level for level, each in enumerate(kicks) if each.speed),
            'wide to': wide.index(False) - 1,
            'wide': [level for level, enough in enumerate(wide) if enough],
            'kicks': [[each.speed, each.room] for each in kicks],
        }
    return found


if __name__ == '__main__':
    sys.exit(run('carried', __doc__, carried, entries=['bits_5'], modules=MODULES))
