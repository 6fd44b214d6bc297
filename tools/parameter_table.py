# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Write the table of parameters into README.md, from the declarations themselves.

.venv/bin/python tools/parameter_table.py
"""

import dataclasses
import re
from pathlib import Path
from typing import Any

from mlmem_ros.described import Description, descriptions
from mlmem_ros.device import Faults, Settings
from mlmem_ros.physics import CASE_II
from mlmem_ros.ros.settings import PublishSettings, RecordSettings, StateSettings

README = Path(__file__).resolve().parent.parent / 'README.md'
BEGIN, END = '<!-- parameters: begin -->', '<!-- parameters: end -->'


def table() -> str:
    """Return the table in Markdown."""
    rows = [
        '| parameter | default | unit | range | meaning |',
        '|---|---|---|---|---|',
        '| `target_level` | 0 | | 0 to p - 1 | level that `~/write` writes |',
        '| `time.speed` | 1 | | from 0 | factor on real time; 0: as fast as it can |',
        '| `autostart` | true | | | configure and activate at the start |',
        '| `design.preset` | case_2 | | case_1, case_2 | design that the others start from |',
        '| `design.check` | refuse | | refuse, warn, off | what a design that fails its check '
        'does at configure |',
    ]
    settings = Settings()
    groups: dict[str, Any] = {'design': CASE_II}
    groups |= {field.name: getattr(settings, field.name) for field in dataclasses.fields(settings)}
    groups |= {
        'publish': PublishSettings(),
        'record': RecordSettings(),
        'state': StateSettings(),
        'faults': Faults(),
    }
    for prefix, group in groups.items():
        for field, description in descriptions(group):
            value = getattr(group, field.name)
            rows.append(
                f'| `{prefix}.{field.name}` | {_default(value)} | {description.unit} '
                f'| {_range(description)} | {description.text.replace("|", "&#124;")} |'
            )
    return '\n'.join(rows)


def _default(value: Any) -> str:
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


def with_table(text: str) -> str:
    """Return a README with its table renewed."""
    pattern = re.compile(f'{BEGIN}.*?{END}', re.DOTALL)
    return pattern.sub(lambda _: f'{BEGIN}\n{table()}\n{END}', text)


if __name__ == '__main__':
    README.write_text(with_table(README.read_text(encoding='utf-8')), encoding='utf-8')
