# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Reading: decode the content, of a wall that has settled."""

from __future__ import annotations

from ..commands import Outcome
from ..errors import ProcedureFailed
from ..instrument.blocks import Procedure
from ..memory import Memory
from ..readers.reading import UNDECODABLE


def read(element: Memory, end: str = '') -> Procedure[Outcome]:
    """Read the content (see `Reader.read_settled`), and answer with the delay at one end.

    Raises:
        ProcedureFailed: The content cannot be decoded, or the element does not come to rest.
    """
    reading = yield from element.reader.read_settled(element, end)
    if reading.level == UNDECODABLE:
        raise ProcedureFailed(reading.reason)
    return Outcome(reading)
