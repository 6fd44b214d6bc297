# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Bags in rosbag2's format: recorded safely, read tolerantly.

Nothing here needs a ROS graph. Modules are imported on first use: only readers and writers need
`mcap` and `rosbags`.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .contents import Loss, Message
    from .definitions import Codec, Definition, codec_of, jazzy
    from .errors import BagError
    from .metadata import BagMetadata, FileInfo, TopicInfo
    from .qos import LATCHED, RELIABLE, SENSOR_DATA, QosProfile
    from .reader import BagReader
    from .recorder import DROPPED_KEY, Recorder, RecorderStatus
    from .repairing import Repaired, repair
    from .writer import BagWriter

__all__ = [
    'DROPPED_KEY',
    'LATCHED',
    'RELIABLE',
    'SENSOR_DATA',
    'BagError',
    'BagMetadata',
    'BagReader',
    'BagWriter',
    'Codec',
    'Definition',
    'FileInfo',
    'Loss',
    'Message',
    'QosProfile',
    'Recorder',
    'RecorderStatus',
    'Repaired',
    'TopicInfo',
    'codec_of',
    'jazzy',
    'repair',
]

_HOMES = {
    'contents': ('Loss', 'Message'),
    'definitions': ('Codec', 'Definition', 'codec_of', 'jazzy'),
    'errors': ('BagError',),
    'metadata': ('BagMetadata', 'FileInfo', 'TopicInfo'),
    'qos': ('LATCHED', 'RELIABLE', 'SENSOR_DATA', 'QosProfile'),
    'reader': ('BagReader',),
    'recorder': ('DROPPED_KEY', 'Recorder', 'RecorderStatus'),
    'repairing': ('Repaired', 'repair'),
    'writer': ('BagWriter',),
}
"""Modules, and the names they define."""


def __getattr__(name: str) -> Any:
    for module, names in _HOMES.items():
        if name in names:
            return getattr(import_module(f'.{module}', __name__), name)
    raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
