# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Write the table of parameters into README.md, from the declarations themselves.

.venv/bin/python tools/parameter_table.py
"""

import re
from pathlib import Path
from typing import Any

from mlmem_ros.described import Description
from mlmem_ros.ros.node.declarations import declarations

README = Path(__file__).resolve().parent.parent / 'README.md'
BEGIN, END = '<!-- parameters: begin -->', '<!-- parameters: end -->'


def table() -> str:
    """Return the table in Markdown."""
    rows = [
        '| parameter | default | unit | range | meaning |',
        '|---|---|---|---|---|',
    ]
    for name, default, description in declarations():
        legal = '0 to p - 1' if name == 'target_level' else _range(description)
        rows.append(
            f'| `{name}` | {_default(default)} | {description.unit} | {legal} '
            f'| {description.text.replace("|", "&#124;")} |'
        )
    return '\n'.join(rows)


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


def with_table(text: str) -> str:
    """Return a README with its table renewed."""
    pattern = re.compile(f'{BEGIN}.*?{END}', re.DOTALL)
    return pattern.sub(lambda _: f'{BEGIN}\n{table()}\n{END}', text)


if __name__ == '__main__':
    README.write_text(with_table(README.read_text(encoding='utf-8')), encoding='utf-8')
