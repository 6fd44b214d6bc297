# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Ends that strayed into a third ground state are brought back before they are driven."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from ..instrument.blocks import Procedure, catch_up, wait, wait_for_ends
from ..instrument.end import End, EndMove

if TYPE_CHECKING:
    from ..memory import Memory


def bring_back(element: Memory, end: End) -> Procedure[None]:
    """Move an end that strayed into a third ground state back to the active phase.

    A wall driven over a free end returns as a wall between the active phase and the next. No
    strain moves it, but the wall launched here removes it within some 90 cells.
    """
    element.forget_content('an end was brought back')
    element.progress.phase = 'launching'
    start = element.transducer.find_displacement(end)
    # speeds of 0.1 to 0.4 work
    element.transducer.drive_end(end, EndMove(start, element.design.D_s2, 0.2))
    yield from wait_for_ends(element)
    yield from wait(element, element.settings.erase.settle)
    yield from catch_up(element)


def bring_ends_back(element: Memory, ends: Iterable[End] = End) -> Procedure[None]:
    """Bring back those of some ends that strayed."""
    yield from catch_up(element)
    for end in ends:
        if element.phase(end) is None:
            yield from bring_back(element, end)
