# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Design checks and shipped elements."""

from mlmem import ELEMENT_NAMES, load_element
from mlmem_tools.checks import check

from .parameters import list_settings
from .table import make_table


def generate_checks() -> dict[str, str]:
    """Return what is checked of the paper's Case II, which passes."""
    findings = check(*load_element('case_2').design_and_settings).findings
    rows = [[f'`{found.name}`', found.unit, found.text] for found in findings]
    return {'checks': make_table(['quantity', 'unit', 'what it means'], rows)}


def generate_elements() -> dict[str, str]:
    """Return the size of every shipped element, and all settings."""
    sizes = []
    for name in ELEMENT_NAMES:
        design = load_element(name).design
        size = (design.levels, design.N, design.J, 1.0 / design.eta)
        sizes.append([f'`{name}`', *(f'{number:.6g}' for number in size)])
    return {
        'sizes': make_table(['element', 'levels', 'N', 'J', '1/eta'], sizes),
        'settings': list_settings(),
    }
