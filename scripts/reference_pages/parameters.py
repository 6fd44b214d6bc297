# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Parameters of the node, and settings of an element."""

from typing import Any

from mlmem import Settings
from mlmem.physics import CASE_II
from mlmem.schema import Description, find_descriptions
from mlmem_ros.host.settings import declare_parameters

from .table import make_table


def generate_parameters() -> dict[str, str]:
    """Return every parameter of the node."""
    rows = [
        [
            f'`{name}`',
            _format_default(default, description),
            '-1 to p - 1' if name == 'target_level' else _format_range(description),
            description.text,
        ]
        for name, default, description in declare_parameters()
    ]
    return {'parameters': make_table(['parameter', 'default', 'range', 'meaning'], rows)}


def list_settings() -> str:
    """Return every value of an element file that is not one of the individual element.

    Keys of the same name and meaning in several groups share a row.
    """
    shared: dict[tuple[str, ...], dict[str, str]] = {}
    for group, owner in {'design': CASE_II, **Settings().list_groups()}.items():
        for field, description in find_descriptions(owner):
            defaults = shared.setdefault(
                (field.name, description.unit, ', '.join(description.choices), description.text),
                {},
            )
            defaults[f'`{group}.{field.name}`'] = _format_default(
                getattr(owner, field.name), description
            )
    rows = [
        [
            ', '.join(defaults),
            ', '.join(dict.fromkeys(defaults.values())),
            f'{text} ({choices})' if choices else text,
        ]
        for (_, _, choices, text), defaults in shared.items()
    ]
    return make_table(['key', 'default', 'meaning'], rows)


def _format_default(value: Any, description: Description) -> str:
    """Return a default with its unit."""
    if isinstance(value, bool):
        return str(value).lower()
    number = f'{value:.6g}' if isinstance(value, float) else str(value)
    return f'{number} {description.unit}'.strip()


def _format_range(description: Description) -> str:
    if description.choices:
        return ', '.join(filter(None, description.choices))
    low, high = description.low, description.high
    if low is not None and high is not None:
        return f'{low:g} to {high:g}'
    if low is not None:
        return f'from {low:g}'
    return f'up to {high:g}' if high is not None else ''
