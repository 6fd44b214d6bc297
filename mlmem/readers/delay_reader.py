# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Reading one wall by the delay of its echoes, as in the paper.

A pulse of either end is reflected by the wall. Both ends listen at the same time, for both must
detect the same wall (see `decoding.decode_echoes`).
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, ClassVar

from ..errors import Astray
from ..instrument.blocks import Procedure
from ..instrument.echo import ECHO_TAIL_TIME
from ..instrument.end import End
from ..physics import Design
from .listening import probe_ends, wait_for_decay
from .reading import UNDECODABLE, Reading

if TYPE_CHECKING:
    from ..memory import Memory


class DelayReader:
    """Decodes the level of one wall from the delays at both ends; see `Reader`."""

    holds_words: ClassVar[bool] = False
    unusable_reasons: ClassVar[Mapping[int, str]] = MappingProxyType({})
    limits: ClassVar[str] = ''

    def __init__(self, design: Design) -> None:
        """Make the reader of a design."""
        self.content_count = design.levels
        self.single_walls: Mapping[int, int] = {level: level for level in range(design.levels)}

    def list_walls(self, content: int) -> tuple[int, ...]:
        """Return the level of the wall; nothing for a blank element."""
        return (content,) if content >= 0 else ()

    def read_duration(self, element: Memory) -> float:
        """Return the time for the longest echo, and the rest before it."""
        longest = max(element.calibration.table(end).longest_delay for end in End)
        return element.settings.read.rest + longest + ECHO_TAIL_TIME

    def read(self, element: Memory, end: str = '') -> Procedure[Reading]:
        """Probe both ends and decode the echoes; while the base shakes, until they are decoded.

        The left end's carrier lies above the band of the inactive phase and so cannot leave the
        left end of a blank element, and vice versa: then only the other end is probed.

        Raises:
            ProcedureFailed: The element does not come to rest, or listening was interrupted.
        """
        for _ in range(element.settings.read.attempts):
            yield from wait_for_decay(element)
            try:
                echoes = yield from probe_ends(element, element.detecting_ends)
            except Astray as error:
                return element.store_unreadable(str(error))
            reading = element.store_echoes(echoes, end)
            shaken = any(echo.shaken for echo in echoes.values())
            if not shaken or reading.level != UNDECODABLE or reading.walls is not None:
                break
        return reading

    def needs_calibration(self, element: Memory) -> bool:
        """Return False: the delays of an ideal element serve."""
        return False

    def needs_second_read(self, reading: Reading) -> bool:
        """Return whether both ends detect an echo, but not of the same wall."""
        delays = reading.left_delay, reading.right_delay
        return reading.level == UNDECODABLE and None not in delays
