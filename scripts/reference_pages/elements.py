# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Design checks and shipped elements."""

from mlmem import preset, presets
from mlmem_tools.checks import check

from .parameters import list_settings
from .table import table


def generate_checks() -> dict[str, str]:
    """Return what is checked of the paper's Case II, which passes."""
    rows = [
        [f'`{found.name}`', found.unit, found.text] for found in check(*preset('case_2')).findings
    ]
    return {'checks': table(['quantity', 'unit', 'what it means'], rows)}


def generate_elements() -> dict[str, str]:
    """Return the size of every shipped element, and all settings."""
    names: dict[int, list[str]] = {}
    for name, one in presets.PRESETS.items():
        names.setdefault(id(one), []).append(name)
    sizes = []
    for some in names.values():
        design, _ = preset(some[0])
        named = ', '.join(f'`{name}`' for name in some)
        size = (design.levels, design.N, design.J, 1.0 / design.eta)
        sizes.append([named, *(f'{number:.6g}' for number in size)])
    return {
        'sizes': table(['element', 'levels', 'N', 'J', '1/eta'], sizes),
        'settings': list_settings(),
    }
