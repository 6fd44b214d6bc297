# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Bags as rosbag2 writes them: recorded safely, read tolerantly. It knows no ROS graph."""

from .contents import Loss, Message
from .definitions import Codec, Definition, codec_of, jazzy
from .errors import BagError
from .metadata import BagMetadata, FileInfo, TopicInfo
from .qos import LATCHED, RELIABLE, SENSOR_DATA, QosProfile
from .reader import BagReader
from .recorder import DROPPED_KEY, Recorder, RecorderStatus
from .repair import RepairReport, repair
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
    'RepairReport',
    'TopicInfo',
    'codec_of',
    'jazzy',
    'repair',
]
