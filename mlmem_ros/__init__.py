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


def __getattr__(name: str) -> Any:
    if name in ('BankCheckFailed', 'BankValue', 'MemoryBank'):
        from .packages import find_tool  # `mlmem_tools` defines them

        return find_tool(name).load()
    modules = {
        'MemoryClient': 'ros.client.client',
        'standalone': 'ros.client.client',
        'Reply': 'ros.client.reply',
        'MemoryNode': 'ros.node.node',
    }
    if name in __all__:
        module = modules.get(name, 'contract.answers')
        return getattr(import_module(f'.{module}', __name__), name)
    raise AttributeError(f'module {__name__!r} has no attribute {name!r}')


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
