# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The frames between a driver and its rig, as bytes; `docs/drivers.md` has the format."""

from __future__ import annotations

import struct
import zlib
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from ..physics.potential import Array

VERSION = 1
"""Of all that is described here: both sides tell theirs in their hello."""

MAGIC = b'mR'

HEADER = struct.Struct('<2sBQIH')
"""Magic, kind, number, length of the payload, and the low half of the CRC-32 of these."""

CHECK = struct.Struct('<I')
"""CRC-32 of header and payload, behind them."""

MOST_PAYLOAD = 1 << 22
"""Bytes: a longer payload is no frame."""

PLAY = struct.Struct('<QIII')
"""First sample, samples, site of the held end (0: none), set-points for which it is held."""

SAMPLES = struct.Struct('<QIId')
"""First sample, samples, samples that the rig was left alone for before them, force or NaN."""


class Kind(IntEnum):
    """What a frame is."""

    HELLO = 1  # JSON, from either side; it begins anew
    PLAY = 2
    SAMPLES = 3
    AGAIN = 4  # no payload: send all frames again from this number on
    FAULT = 5  # a text: the rig has stopped


KINDS = frozenset(Kind)


class Frame(NamedTuple):
    """A frame that has come."""

    kind: Kind
    number: int
    payload: bytes


class Played(NamedTuple):
    """Samples of a rig; lengths in its own unit.

    Attributes:
        first: Number of the first one.
        ends: What both ends did, shape (2, n).
        missed: Samples for which the rig was left alone just before.
        force: On the substrate's end, or NaN.
    """

    first: int
    ends: Array
    missed: int
    force: float


def encode(kind: Kind, number: int, payload: bytes = b'') -> bytes:
    """Return a frame as bytes."""
    frame = _header(kind, number, len(payload)) + payload
    return frame + CHECK.pack(zlib.crc32(frame))


def _header(kind: int, number: int, length: int) -> bytes:
    check = zlib.crc32(HEADER.pack(MAGIC, kind, number, length, 0)[:-2])
    return HEADER.pack(MAGIC, kind, number, length, check & 0xFFFF)


class Parser:
    """Finds frames among bytes, whatever else is there.

    Attributes:
        skipped: Bytes that were in no frame.
    """

    def __init__(self) -> None:
        self.skipped = 0
        self._buffer = b''

    def feed(self, data: bytes) -> list[Frame]:
        """Return the frames that end in these bytes."""
        self._buffer += data
        found = []
        while len(self._buffer) >= HEADER.size:
            if (size := self._size()) > len(self._buffer):
                break
            raw, check = self._buffer[: size - CHECK.size], self._buffer[size - CHECK.size : size]
            if size and CHECK.pack(zlib.crc32(raw)) == check:
                _, kind, number, *_ = HEADER.unpack_from(raw)
                found.append(Frame(Kind(kind), number, raw[HEADER.size :]))
                self._buffer = self._buffer[size:]
            else:
                start = self._buffer.find(MAGIC[:1], 1)
                start = len(self._buffer) if start < 0 else start
                self.skipped += start
                self._buffer = self._buffer[start:]
        return found

    def _size(self) -> int:
        """Return the size of the frame that the buffer begins with, 0 where it is none."""
        magic, kind, number, length, _ = HEADER.unpack_from(self._buffer)
        if magic != MAGIC or kind not in KINDS or length > MOST_PAYLOAD:
            return 0
        whole = self._buffer.startswith(_header(kind, number, length))
        return HEADER.size + length + CHECK.size if whole else 0


def play(first: int, samples: int, V_N: Array, site: int, motion: Array, kind: str) -> bytes:
    """Return the payload of set-points.

    Args:
        first: Number of the first sample.
        samples: How many.
        V_N: Displacement of the substrate's end, shape (samples nodes,).
        site: The end that is held, 1 or N; 0 for none.
        motion: Its displacement and velocity, shape (2, m).
        kind: Of the numbers: '<f4' or '<f8'.
    """
    head = PLAY.pack(first, samples, site, motion.shape[1])
    return head + V_N.astype(kind).tobytes() + motion.astype(kind).tobytes()


def played(payload: bytes, kind: str) -> Played:
    """Return the samples that a payload holds.

    Raises:
        ValueError: Their number is not the one it tells.
    """
    if len(payload) < SAMPLES.size:
        raise ValueError(f'{len(payload)} bytes')
    first, samples, missed, force = SAMPLES.unpack_from(payload)
    numbers = len(payload) - SAMPLES.size
    if numbers != 2 * samples * np.dtype(kind).itemsize:
        raise ValueError(f'{numbers} bytes for {samples} samples of both ends')
    ends = np.frombuffer(payload, kind, offset=SAMPLES.size).astype(np.float64)
    return Played(first, ends.reshape(2, samples), missed, force)
