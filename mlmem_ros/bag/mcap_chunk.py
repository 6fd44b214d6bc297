# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A chunk of an MCAP file while it fills."""

from __future__ import annotations

import struct
import zlib

import zstandard
from mcap.opcode import Opcode
from mcap.records import Chunk, MessageIndex

from .errors import BagError

# A message record up to its data: opcode, length, channel, sequence, log time, publish time.
_MESSAGE = struct.Struct('<BQHIQQ')
_MESSAGE_FIXED = 22  # bytes of its content besides the data

COMPRESSIONS = ('zstd', 'none')
"""Names of the compressions a chunk can have."""


def check_compression(name: str) -> None:
    """Refuse a compression that is none of `COMPRESSIONS`.

    Args:
        name: The name.

    Raises:
        BagError: There is no such compression.
    """
    if name not in COMPRESSIONS:
        raise BagError(f'compression must be one of {", ".join(COMPRESSIONS)}; got {name!r}.')


class ChunkBuilder:
    """Collects messages, and where in the chunk each is."""

    def __init__(self) -> None:
        self._content = bytearray()
        self._indexes: dict[int, MessageIndex] = {}

    @property
    def size(self) -> int:
        """Bytes collected, before compression."""
        return len(self._content)

    def add(self, channel: int, data: bytes, log_time: int, publish_time: int) -> None:
        """Append a message.

        Args:
            channel: Id of its channel.
            data: The encoded message.
            log_time: When it was received, in nanoseconds.
            publish_time: When it was sent, in nanoseconds.
        """
        index = self._indexes.get(channel)
        if index is None:
            index = self._indexes[channel] = MessageIndex(channel, [])
        index.records.append((log_time, len(self._content)))
        # rosbag2 numbers no messages either: the sequence is 0.
        self._content += _MESSAGE.pack(
            Opcode.MESSAGE, _MESSAGE_FIXED + len(data), channel, 0, log_time, publish_time
        )
        self._content += data

    def finish(self, compression: str) -> tuple[Chunk, list[MessageIndex]]:
        """Make records of what was collected.

        Args:
            compression: One of `COMPRESSIONS`.

        Returns:
            The chunk with its CRC, and the index of each of its channels.
        """
        compressed = compression == 'zstd'
        content = bytes(self._content)
        times = [time for index in self._indexes.values() for time, _ in index.records]
        chunk = Chunk(
            compression='zstd' if compressed else '',
            data=zstandard.compress(content) if compressed else content,
            message_start_time=min(times),
            message_end_time=max(times),
            uncompressed_crc=zlib.crc32(content),
            uncompressed_size=len(content),
        )
        return chunk, list(self._indexes.values())
