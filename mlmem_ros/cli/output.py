# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The result of a sub-command in machine-readable form, for the option `--json`."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Mapping, Sequence
from enum import Enum
from typing import Any


def print_json(result: Any) -> None:
    """Print a result as one JSON object.

    Args:
        result: Of mappings, sequences, dataclasses, arrays and plain values; anything else becomes
            text. JSON has no infinity and no NaN: these become null.
    """
    print(json.dumps(_plain(result), indent=2), flush=True)


def markdown(lines: Sequence[Sequence[str]]) -> str:
    """Return a Markdown table; the first line has the headings."""
    heading, *rows = ('| ' + ' | '.join(line) + ' |\n' for line in lines)
    return ''.join((heading, '|' + '---|' * len(lines[0]) + '\n', *rows))


def _plain(value: Any) -> Any:
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        value = {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}
    if isinstance(value, Enum):
        value = value.value
    if hasattr(value, 'tolist'):  # of numpy
        value = value.tolist()
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple, set, frozenset)):
        return [_plain(item) for item in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value if value is None or isinstance(value, (bool, int, str)) else str(value)
