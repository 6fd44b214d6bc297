# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Parameters of the node, and settings of an element."""

from collections.abc import Iterator
from typing import Any

from mlmem import Settings
from mlmem.physics import CASE_II
from mlmem.schema import Description, find_descriptions
from mlmem_ros.host.settings import declare_parameters

from .table import table

HEAD = ['parameter', 'default', 'unit', 'range', 'meaning']


def generate_parameters() -> dict[str, str]:
    """Return every parameter of the node."""
    groups: dict[str, list[list[str]]] = {}
    for name, default, description in declare_parameters():
        legal = '-1 to p - 1' if name == 'target_level' else _range(description)
        row = [f'`{name}`', _default(default), description.unit, legal, description.text]
        groups.setdefault(name.rpartition('.')[0], []).append(row)
    tables = '\n'.join(
        f'### {f"`{group}.*`" if group else "The node"}\n\n{table(HEAD, rows)}\n'
        for group, rows in groups.items()
    )
    return {'parameters': tables}


def list_settings() -> str:
    """Return every value of an element file that is not one of the individual element."""
    groups = {'design': CASE_II, **Settings().groups()}
    return '\n'.join(
        f'### `{group}`\n\n{table(["key", *HEAD[1:]], list(_rows(owner)))}\n'
        for group, owner in groups.items()
    )


def _rows(owner: Any) -> Iterator[list[str]]:
    for field, description in find_descriptions(owner):
        default = _default(getattr(owner, field.name))
        yield [f'`{field.name}`', default, description.unit, _range(description), description.text]


def _default(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return value or "''"
    return f'{value:.6g}' if isinstance(value, float) else str(value)


def _range(description: Description) -> str:
    if description.choices:
        return ', '.join(description.choices)
    low, high = description.low, description.high
    if low is not None and high is not None:
        return f'{low:g} to {high:g}'
    if low is not None:
        return f'from {low:g}'
    return f'up to {high:g}' if high is not None else ''
