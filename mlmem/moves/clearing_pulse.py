# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The clearing pulse: all walls of a register leave at the left end (docs/strainless.md)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

from ..instrument.blocks import Procedure, wait, wait_for_ends
from ..instrument.echo import pulse_duration
from ..instrument.end import End
from ..memory import Memory
from ..physics import Design
from ..settings import Settings
from .ends import bring_ends_back
from .move import Drive, Move, blank_content


@dataclass(frozen=True)
class ClearingPulse(Move):
    """A strong pulse of an end, after which the walls leave and its waves decay; see `Move`."""

    name: ClassVar[str] = 'clearing pulse'

    def drive(self, element: Memory, how: Drive) -> Procedure[None]:
        """Bring back ends that strayed, fire the pulse, and let its waves decay; raises as
        `Instrument.require_phase`.
        """
        settings = element.settings.clearing_pulse
        yield from bring_ends_back(element)
        element.require_phase(End(settings.end))
        element.begin_cycle('cleared')
        element.progress.phase = 'launching'
        element.transducer.fire_clearing_pulse(End(settings.end), settings)
        yield from wait_for_ends(element)
        element.last_moved = element.ticks
        yield from wait(element, settings.settle)


def moves_from(
    design: Design, settings: Settings, start: int, target: int
) -> Iterator[ClearingPulse]:
    """Yield the clearing pulse of a register, if it has one; kicks clear the others."""
    if settings.register.spacing and settings.clearing_pulse.A:
        pulse = settings.clearing_pulse
        duration = pulse_duration(pulse) + pulse.settle
        yield ClearingPulse(start, blank_content(settings), duration)
