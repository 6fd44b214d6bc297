# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Mechanical multi-level memory for robots: material, device, sessions and ROS 2 node.

Everything a robot's code needs is here: `MemoryClient`, `MemoryBank`, `standalone`, their answers
and errors, and `MemoryNode` for an element in a program of one's own. Names are imported on first
use; `import mlmem_ros` needs no ROS.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .contract.answers import (
        BankFailed,
        Calibrated,
        Decoded,
        Done,
        NoAnswer,
        RequestError,
        RequestFailed,
        RequestRefused,
        SelfTested,
    )
    from .ros.client.client import MemoryClient, standalone
    from .ros.client.reply import Reply
    from .ros.node.node import MemoryNode

__version__ = '1.0.0'

__all__ = [
    'BankCheckFailed', 'BankFailed', 'BankValue', 'Calibrated', 'Decoded', 'Done', 'MemoryBank',
    'MemoryClient', 'MemoryNode', 'NoAnswer', 'Reply', 'RequestError', 'RequestFailed',
    'RequestRefused', 'SelfTested', '__version__', 'standalone',
]  # fmt: skip

_NAMES_BY_MODULE = {
    'contract.answers': (
        'BankFailed', 'Calibrated', 'Decoded', 'Done', 'NoAnswer', 'RequestError', 'RequestFailed',
        'RequestRefused', 'SelfTested',
    ),
    'ros.client.client': ('MemoryClient', 'standalone'),
    'ros.client.reply': ('Reply',),
    'ros.node.node': ('MemoryNode',),
}  # fmt: skip
"""Modules, and the names they define."""

_TOOL_NAMES = ('BankCheckFailed', 'BankValue', 'MemoryBank')
"""Names that `mlmem_tools` defines."""


def __getattr__(name: str) -> Any:
    for module, names in _NAMES_BY_MODULE.items():
        if name in names:
            return getattr(import_module(f'.{module}', __name__), name)
    if name in _TOOL_NAMES:
        from .packages import find_tool

        return find_tool(name).load()
    raise AttributeError(f'module {__name__!r} has no attribute {name!r}')


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
