# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Aborting: release cells and strain, gently."""

from __future__ import annotations

from ..memory import Memory
from .blocks import Procedure, Result, ramp


def abort(element: Memory) -> Procedure[Result]:
    """Release a held cell and bring the strain to zero, smoothly.

    As slowly as an erase: at the highest rate, one element in twenty was left with cells in a
    third ground state, which no strain clears (see `bring_back`).
    """
    times = element.settings.erase
    element.transducer.release()
    if element.actuator.strain != 0.0 or element.actuator.moving:
        yield from ramp(element, 0.0, times.release)
    return Result(None)
