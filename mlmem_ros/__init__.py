# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Mechanical multi-level memory for robots: material, device, sessions and ROS 2 node.

What robot code needs is here: `MemoryClient`, `MemoryBank`, `standalone` and what they answer
and raise. It is imported when it is first used; `import mlmem_ros` needs no ROS.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .ros.answers import Calibrated, Decoded, Done, SelfTested
    from .ros.bank import BankFailed, MemoryBank, Word
    from .ros.client import MemoryClient
    from .ros.errors import NoAnswer, RequestError, RequestFailed, RequestRefused
    from .ros.reply import Reply
    from .ros.standalone import standalone

__version__ = '0.1.0'

__all__ = [
    'BankFailed',
    'Calibrated',
    'Decoded',
    'Done',
    'MemoryBank',
    'MemoryClient',
    'NoAnswer',
    'Reply',
    'RequestError',
    'RequestFailed',
    'RequestRefused',
    'SelfTested',
    'Word',
    'standalone',
]

_HOMES = {
    'answers': ('Calibrated', 'Decoded', 'Done', 'SelfTested'),
    'bank': ('BankFailed', 'MemoryBank', 'Word'),
    'client': ('MemoryClient',),
    'errors': ('NoAnswer', 'RequestError', 'RequestFailed', 'RequestRefused'),
    'reply': ('Reply',),
    'standalone': ('standalone',),
}
"""Modules of `mlmem_ros.ros`, and the names that are at home there."""


def __getattr__(name: str) -> Any:
    for module, names in _HOMES.items():
        if name in names:
            return getattr(import_module(f'.ros.{module}', __name__), name)
    raise AttributeError(f'module {__name__!r} has no attribute {name!r}')


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
