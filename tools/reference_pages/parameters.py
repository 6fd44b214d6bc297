# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Parameters of the node."""

from collections.abc import Mapping
from typing import Any

from mlmem.instrument.fault_script import FAULT_MEANINGS, Meaning
from mlmem.schema import Description
from mlmem_ros.host.settings import (
    LIVE_PARAMETERS,
    NODE_PARAMETERS,
    PRESET_GROUPS,
    declare_parameters,
)

from .table import table


def parameters_page() -> str:
    """Return every parameter: those of a robot, and those that a preset brings."""
    own: dict[str, list[list[str]]] = {}
    others: dict[str, list[list[str]]] = {}
    for name, default, description in declare_parameters():
        legal = '-1 to p - 1' if name == 'target_level' else _range(description)
        row = [f'`{name}`', _default(default), description.unit, legal, description.text]
        group = name.partition('.')[0] if '.' in name else ''
        brought = group in PRESET_GROUPS and name not in (*LIVE_PARAMETERS, *NODE_PARAMETERS)
        (others if brought else own).setdefault(group, []).append(row)
    head = ['parameter', 'default', 'unit', 'range', 'meaning']

    def tables(groups: Mapping[str, list[list[str]]]) -> str:
        return '\n'.join(
            f'### {f"`{group}.*`" if group else "The node"}\n\n{table(head, rows)}\n'
            for group, rows in groups.items()
        )

    return (
        '# Parameters\n\n'
        'Defaults are those of the preset `case_2`. `target_level`, `target_word`, `time.speed`, '
        '`write.method`, `service_configure_introspection`, `faults.*` and `record.*`, except '
        '`record.hash_every`, may be set at any time, all others only while unconfigured. '
        'Times are in time units sqrt(m / k_r), `scale.time` seconds each; lengths in cells, '
        '`scale.length` metres each.\n\n'
        f'## Of the robot\n\n{tables(own)}\n'
        '## Brought by a preset or a file\n\n'
        'A preset or a `design.file` sets all of these; a '
        '[parameter file](files.md#parameter-files) or `-p NAME:=VALUE` overrides them.\n\n'
        f'{tables(others)}\n'
        f'## Failures by name\n\n{_failures()}\n'
    )


def _failures() -> str:
    """Return what `mlmem inject` knows."""
    rows = [
        [unit, failure, f'`faults.{each.fault}`', each.text, _severity(each)]
        for (unit, failure), each in FAULT_MEANINGS.items()
    ]
    return table(['unit', 'failure', 'sets', 'what it does', 'usual severity'], rows)


def _severity(meaning: Meaning) -> str:
    return f'{meaning.severity:g}' if meaning.scaled else ''


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
