# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Reading: decode the content, of a wall that has settled."""

from __future__ import annotations

from ..commands import Outcome
from ..errors import ProcedureFailed
from ..instrument.blocks import Procedure
from ..memory import Memory
from ..readers.listening import swinging_time, wait_until_pinned
from ..readers.reading import UNDECODABLE, Reading


def take_settled_reading(element: Memory, end: str = '') -> Procedure[Reading]:
    """Read the content; if a wall that still swings gave no level, read again once it has settled.

    The echo of a wall that swings after a strain or a kick is too strong, too early or too late.
    """
    reading = yield from element.reader.read(element, end)
    answers = reading.left_delay is not None or reading.right_delay is not None
    if answers and reading.level == UNDECODABLE and swinging_time(element) > 0.0:
        yield from wait_until_pinned(element)
        reading = yield from element.reader.read(element, end)
    return reading


def read(element: Memory, end: str = '') -> Procedure[Outcome]:
    """Read the content (see `take_settled_reading`), and answer with the delay at one end.

    Args:
        element: The element to read.
        end: 'left', 'right' or 'both'; empty means the one in the settings.

    Raises:
        ProcedureFailed: The content cannot be decoded, or the element does not come to rest.
    """
    reading = yield from take_settled_reading(element, end)
    if reading.level == UNDECODABLE:
        raise ProcedureFailed(reading.reason, code=reading.failure_code)
    return Outcome(reading)
