# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The summary at the end of an MCAP file, by which readers seek."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterable, Sequence

from mcap.opcode import Opcode
from mcap.records import Footer, McapRecord, SummaryOffset

from .mcap_records import encode

_FOOTER_START = struct.Struct('<BQQQ')  # the part of the footer that the CRC covers
_FOOTER_LENGTH = 20  # bytes of its content


def encode_summary(start: int, groups: Iterable[tuple[Opcode, Sequence[McapRecord]]]) -> bytes:
    """Encode the summary section and the footer.

    Args:
        start: Where in the file the summary begins, in bytes.
        groups: Opcode and records of each group. Empty groups leave no trace, for an offset
            to nothing is an error to checkers.

    Returns:
        All that comes between the data section and the magic at the end.
    """
    summary = b''
    offsets = []
    for opcode, records in groups:
        if records:
            group = encode(*records)
            offsets.append(SummaryOffset(opcode, start + len(summary), len(group)))
            summary += group
    offset_start = start + len(summary)
    summary += encode(*offsets)
    footer = _FOOTER_START.pack(Opcode.FOOTER, _FOOTER_LENGTH, start, offset_start)
    crc = zlib.crc32(footer, zlib.crc32(summary))
    return summary + encode(Footer(start, offset_start, crc))
