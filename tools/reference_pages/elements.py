# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Design checks and presets."""

from typing import Any

from mlmem import preset, presets
from mlmem_tools.checks import check

from .table import table


def checks_page() -> str:
    """Return what is checked of the paper's Case II, which passes."""
    rows = [
        [f'`{found.name}`', found.unit, found.text, found.source]
        for found in check(*preset('case_2')).findings
    ]
    return (
        '# Design checks\n\n'
        'What [`mlmem design check`](commands.md) and *configure* judge. The texts are those of '
        '`case_2`, which passes. For a design that does not, they say what goes wrong and what to '
        'change.\n\n'
        f'{table(["quantity", "unit", "what it means", "the paper"], rows)}\n'
    )


def presets_page() -> str:
    """Return the size of every preset, and the schedule of its steps up."""
    names: dict[int, list[str]] = {}
    for name, one in presets.PRESETS.items():
        names.setdefault(id(one), []).append(name)
    sizes, schedules = [], []
    for some in names.values():
        design, settings = preset(some[0])
        named = ', '.join(f'`{name}`' for name in some)
        size = (design.levels, design.N, design.J, 1.0 / design.eta)
        sizes.append([named, *(f'{number:.6g}' for number in size)])
        write = settings.write
        schedules.append([named, *_schedule(write), _peaks(write)])
    head = ['preset', 'ramp', 'hold', 'ease', 'to', 'release', 'settle', 'peak strains']
    return (
        '# Presets\n\n'
        'Times are [settings](settings.md) of a [preset](../presets.md).\n\n'
        f'{table(["preset", "levels", "N", "J", "1/eta"], sizes)}\n\n'
        '## Steps up\n\n'
        'Times are in time units, 0.1 ms at the default scale; *to* is the share of the peak that '
        '*ease* leads to. A step up takes the sum of its times.\n\n'
        f'{table(head, schedules)}\n'
    )


def _schedule(move: Any) -> list[str]:
    to = f'{move.ease_to:g}' if move.ease else ''
    first, last = (move.ramp, move.hold, move.ease), (move.release, move.settle)
    return [*(f'{time:g}' for time in first), to, *(f'{time:g}' for time in last)]


def _peaks(write: Any) -> str:
    return f'{write.compression:g}, {write.tension:+g}'
