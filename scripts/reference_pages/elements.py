# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Design checks and shipped elements."""

from typing import Any

from mlmem import preset, presets
from mlmem_tools.checks import check

from .parameters import list_settings
from .table import table


def generate_checks() -> dict[str, str]:
    """Return what is checked of the paper's Case II, which passes."""
    rows = [
        [f'`{found.name}`', found.unit, found.text, found.source]
        for found in check(*preset('case_2')).findings
    ]
    return {'checks': table(['quantity', 'unit', 'what it means', 'the paper'], rows)}


def generate_elements() -> dict[str, str]:
    """Return the size of every shipped element, the schedule of its steps up, and all settings."""
    names: dict[int, list[str]] = {}
    for name, one in presets.PRESETS.items():
        names.setdefault(id(one), []).append(name)
    sizes, schedules = [], []
    for some in names.values():
        design, settings = preset(some[0])
        named = ', '.join(f'`{name}`' for name in some)
        size = (design.levels, design.N, design.J, 1.0 / design.eta)
        sizes.append([named, *(f'{number:.6g}' for number in size)])
        if settings.actuator.present:
            schedules.append([named, *_schedule(settings.write), _peaks(settings.write)])
    head = ['element', 'ramp', 'hold', 'ease', 'to', 'release', 'settle', 'peak strains']
    return {
        'sizes': table(['element', 'levels', 'N', 'J', '1/eta'], sizes),
        'steps': table(head, schedules),
        'settings': list_settings(),
    }


def _schedule(move: Any) -> list[str]:
    to = f'{move.ease_to:g}' if move.ease else ''
    first, last = (move.ramp, move.hold, move.ease), (move.release, move.settle)
    return [*(f'{time:g}' for time in first), to, *(f'{time:g}' for time in last)]


def _peaks(write: Any) -> str:
    return f'{write.compression:g}, {write.tension:+g}'
