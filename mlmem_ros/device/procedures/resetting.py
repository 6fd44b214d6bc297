# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Resetting: the way home of an element that no strain brings back."""

from __future__ import annotations

from ..errors import ProcedureFailed
from ..memory import Memory
from ..reading import BLANK, describe_level
from .blocks import Procedure, Result
from .listening import look


def reset(element: Memory) -> Procedure[Result]:
    """Replace a simulated element by a fresh one, blank and unstrained, and listen to it.

    Cells driven out of their two phases stay in another ground state, from which neither an erase
    nor a write brings them back. Calibration, faults and history stay.

    Raises:
        ProcedureFailed: The element is real, or the new one does not sound blank, for instance
            because of a fault.
    """
    if not element.simulated:
        raise ProcedureFailed('a real element has to be replaced by hand; its history is kept')
    element.renew()
    reading = yield from look(element)
    if reading.level != BLANK:
        why = reading.reason or describe_level(reading.level)
        raise ProcedureFailed(f'the new element does not sound blank: {why}')
    return Result(reading)
