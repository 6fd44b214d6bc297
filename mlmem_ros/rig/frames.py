# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The frames between a driver and its rig as bytes, the first of which tells a rig's properties.

`docs/reference/rig.md` prints their fields, with the rules.
"""

from __future__ import annotations

import dataclasses
import json
import math
import struct
import zlib
from dataclasses import MISSING, dataclass
from enum import Enum, IntEnum
from functools import partial
from typing import NamedTuple

import numpy as np

from mlmem import Array, DriverError, ErrorCode, Settings, SettingsError
from mlmem.parsing import DecodeError, decode_value, parse_json
from mlmem.schema import describe_field, short_repr

PROTOCOL_VERSION = 1
"""Version of the protocol: both sides send it in their hello."""

FRAME_MAGIC = b'mR'

Field = tuple[str, str]
"""Of a layout: code of `struct`, meaning."""


class Layout(Enum):
    """What a frame and its payloads begin and end with, little-endian.

    Attributes:
        fields: In order.
        size: In bytes.
        pack: Returns values, one for each field, as bytes.
        unpack_from: Returns the values in a buffer, from an offset on.
    """

    HEADER = (
        ('2s', f'`{FRAME_MAGIC.decode()}`'),
        ('B', 'kind'),
        ('Q', 'number: each side counts the frames it sends, and its HELLO is 0'),
        ('I', 'bytes of the payload'),
        ('H', 'low half of the CRC-32 of the bytes above'),
    )
    CHECK = (('I', 'CRC-32 of header and payload'),)
    PLAY = (
        ('Q', 'number of its first sample'),
        ('I', 'samples, n'),
        ('I', 'site of the held end (1 left, N right, 0 none)'),
        ('I', 'set-points for which it is held, h'),
    )
    SAMPLES = (
        ('Q', 'number of its first sample'),
        ('I', 'samples, n'),
        ('I', 'samples without set-points just before it'),
        ('d', "force on the substrate's end (NaN if it is not measured)"),
    )

    def __init__(self, *fields: Field) -> None:
        layout = struct.Struct('<' + ''.join(code for code, _ in fields))
        self.fields = fields
        self.size = layout.size
        self.pack = layout.pack
        self.unpack_from = layout.unpack_from


class FrameKind(IntEnum):
    """Kind of a frame."""

    HELLO = 1
    PLAY = 2
    SAMPLES = 3
    AGAIN = 4
    FAULT = 5


class Frame(NamedTuple):
    """A received frame; its kind may be one that is not known here."""

    kind: int
    number: int
    payload: bytes


class Played(NamedTuple):
    """Samples of a rig; displacements in its own unit.

    Attributes:
        ends: Displacements of both ends, shape (2, n).
        missed: Samples just before them for which the rig had no set-points.
        force: Force on the substrate's end, or NaN.
    """

    first: int
    ends: Array
    missed: int
    force: float


def encode_frame(kind: int, number: int, payload: bytes = b'') -> bytes:
    """Return a frame as bytes."""
    head = Layout.HEADER.pack(FRAME_MAGIC, kind, number, len(payload), 0)[:-2]
    frame = head + struct.pack('<H', zlib.crc32(head) & 0xFFFF) + payload
    return frame + Layout.CHECK.pack(zlib.crc32(frame))


class Parser:
    """Finds frames in a stream of bytes, and skips the rest; after a damaged frame it goes on with
    the next header, which may lie within.

    Attributes:
        skipped: Bytes outside any frame.
        wrong: What was wrong with the last of these; empty without any.
        max_payload_bytes: A longer payload is invalid.
    """

    max_payload_bytes = 1 << 22

    def __init__(self) -> None:
        self.skipped = 0
        self.wrong = ''
        self._lost = False  # whether the last bytes were skipped
        self._buffer = bytearray()

    def feed(self, data: bytes) -> list[Frame]:
        """Return the frames that these bytes complete."""
        self._buffer += data
        found, start = [], 0
        while len(self._buffer) - start >= Layout.HEADER.size:
            size = self._read_size(start)
            if start + size > len(self._buffer):
                break
            if size and (frame := self._read_frame(start, size)):
                found.append(frame)
                start += size
                self._lost = False
            else:
                start = self._skip_damage(start)
        del self._buffer[:start]
        return found

    def _read_size(self, start: int) -> int:
        """Return the size of the frame that begins there, or 0 if its header is invalid."""
        magic, _, _, length, check = Layout.HEADER.unpack_from(self._buffer, start)
        if magic != FRAME_MAGIC:
            if not self._lost:  # or it would be the rest of a damaged frame
                begin = bytes(self._buffer[start : start + 16])
                self.wrong = f'no frame begins with {short_repr(begin)}'
            return 0
        if length > (most := self.max_payload_bytes):
            self.wrong = f'a payload may have at most {most} bytes; got {length}'
            return 0
        expected = zlib.crc32(self._buffer[start : start + Layout.HEADER.size - 2]) & 0xFFFF
        if check != expected:
            self.wrong = f'a header ends with the CRC {check:#06x}; expected {expected:#06x}'
            return 0
        return Layout.HEADER.size + int(length) + Layout.CHECK.size

    def _read_frame(self, start: int, size: int) -> Frame | None:
        """Return the frame that begins there, or None if it is damaged."""
        raw = bytes(self._buffer[start : start + size - Layout.CHECK.size])
        _, kind, number, length, _ = Layout.HEADER.unpack_from(raw)
        (check,) = Layout.CHECK.unpack_from(self._buffer, start + len(raw))
        if check != (expected := zlib.crc32(raw)):
            self.wrong = (
                f'a frame of kind {kind} and {length} bytes ends with the CRC {check:#010x}; '
                f'expected {expected:#010x}'
            )
            return None
        return Frame(kind, number, raw[Layout.HEADER.size :])

    def _skip_damage(self, start: int) -> int:
        """Return where the next frame may begin, after an invalid header or a damaged frame."""
        end = self._buffer.find(FRAME_MAGIC, start + 1)
        if end < 0:  # the last byte may be the first half of a magic
            end = len(self._buffer) - self._buffer.endswith(FRAME_MAGIC[:1])
        self.skipped += end - start
        self._lost = True
        return end


def encode_set_points(
    first: int, samples: int, V_N: Array, site: int, motion: Array, kind: str
) -> bytes:
    """Return the payload of set-points.

    Args:
        V_N: Displacement of the substrate's end, shape (samples nodes,).
        site: The end that is held, 1 or N; 0 for none.
        motion: Its displacement and velocity, shape (2, m).
        kind: Type of the numbers: '<f4' or '<f8'.
    """
    head = Layout.PLAY.pack(first, samples, site, motion.shape[1])
    return head + V_N.astype(kind).tobytes() + motion.astype(kind).tobytes()


def decode_samples(payload: bytes, kind: str) -> Played:
    """Return the samples in a payload.

    Raises:
        ValueError: Its length does not match its number of samples.
    """
    if len(payload) < Layout.SAMPLES.size:
        raise ValueError(f'{len(payload)} bytes')
    first, samples, missed, force = Layout.SAMPLES.unpack_from(payload)
    numbers = len(payload) - Layout.SAMPLES.size
    if numbers != 2 * samples * np.dtype(kind).itemsize:
        raise ValueError(f'{numbers} bytes for {samples} samples of both ends')
    ends = np.frombuffer(payload, kind, offset=Layout.SAMPLES.size).astype(np.float64)
    return Played(first, ends.reshape(2, samples), missed, force)


_number = partial(describe_field, MISSING, low=1e-15, high=1e15)
_count = partial(describe_field, MISSING, low=1)


@dataclass(frozen=True)
class Hello:
    """Properties of a rig."""

    protocol: int = describe_field(
        MISSING, 'version of the protocol', low=PROTOCOL_VERSION, high=PROTOCOL_VERSION
    )
    name: str = describe_field(MISSING, 'its name')
    dt: float = _number('time units from sample to sample')
    # a hello cannot claim memory without limit
    samples: int = _count('samples of a tick: time.tick / dt', high=1 << 14)
    seconds: float = _number('seconds of a sample by its clock: scale.time dt')
    length: float = _number('m of a unit of displacement: scale.length if that is a cell')
    buffer: int = _count('samples of set-points it can hold', high=2**31 - 1)
    force: float = describe_field(1.0, 'N of a unit of force', low=1e-15, high=1e15)
    zero: tuple[float, float] = describe_field(
        (0.0, 0.0), 'readings of the left and the right end at displacement 0'
    )
    nodes: tuple[float, ...] = describe_field(
        (1.0,),
        'when in a sample it takes set-points: a list of at most 16 rising numbers above 0, the '
        'last one 1',
    )
    numbers: str = describe_field('<f8', 'type of set-points and samples', choices=('<f4', '<f8'))
    can: tuple[str, ...] = describe_field(
        ('strain', 'left', 'right'),
        'a list of texts with left, right, and strain if there is an actuator',
    )

    def __post_init__(self) -> None:
        nodes = self.nodes
        if len(nodes) > 16:
            raise ValueError(f'nodes must be at most 16 numbers; got {len(nodes)}')
        if not nodes or list(nodes) != sorted(set(nodes)) or nodes[0] <= 0.0 or nodes[-1] != 1.0:
            raise ValueError(
                f'nodes must be rising numbers above 0, the last one 1; got {short_repr(nodes)}'
            )

    @property
    def has_actuator(self) -> bool:
        """Whether it can strain its element, which is written by kicks otherwise."""
        return 'strain' in self.can

    def payload(self) -> bytes:
        """Return the payload of its frame."""
        return json.dumps(dataclasses.asdict(self)).encode()

    @classmethod
    def of(cls, payload: bytes) -> Hello:
        """Read the payload of a frame.

        Raises:
            DriverError: It is not the hello of a rig of this version; the message names the key.
        """
        try:
            said = parse_json(payload)
            if (
                isinstance(said, dict)
                and said.get('protocol', PROTOCOL_VERSION) != PROTOCOL_VERSION
            ):
                expected = f'version {PROTOCOL_VERSION}, as that of this driver'
                raise DecodeError.out_of_range('protocol', said['protocol'], expected)
            hello: Hello = decode_value(cls, said)
        except DecodeError as error:
            raise DriverError(f'the hello of the rig: {error}') from error
        return hello

    def check(self, settings: Settings) -> None:
        """Raise `SettingsError` if settings do not fit this rig."""
        time, scale = settings.time, settings.scale
        if not {'left', 'right'} <= set(self.can):
            expected = 'left and right at least, so that the rig drives and senses either end'
            raise SettingsError(ErrorCode.CONFLICT, 'can', self.can, expected)
        if not math.isclose(self.samples * self.dt, time.tick, rel_tol=1e-9):
            expected = f'that of the rig, {self.samples * self.dt:.10g}'
            raise SettingsError(ErrorCode.CONFLICT, 'time.tick', time.tick, expected)
        if not math.isclose(self.seconds / self.dt, scale.time, rel_tol=1e-6):
            expected = f'that of the rig, {self.seconds / self.dt:.6g} s'
            raise SettingsError(ErrorCode.CONFLICT, 'scale.time', scale.time, expected)
