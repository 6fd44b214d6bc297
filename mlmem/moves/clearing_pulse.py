# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The clearing pulse: all walls of a register leave at the left end (docs/strainless.md)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..errors import Checked
from ..instrument.blocks import Procedure, move_end, wait
from ..instrument.echo import pulse_duration
from ..instrument.end import End, Pulse
from ..physics import Design
from ..schema import describe_field, describe_time
from .move import Drive, Move, blank_content, bring_ends_back

if TYPE_CHECKING:
    from ..memory import Memory
    from ..settings import Settings


@dataclass(frozen=True)
class ClearingPulseSettings(Checked):
    """The strong pulse that clears a register: all its walls leave at the left end."""

    end: str = describe_field('right', 'end that is driven', choices=('left', 'right'))
    omega_c: float = describe_field(0.8, 'carrier frequency', unit='rad/time', low=1e-3, high=10.0)
    A: float = describe_field(
        0.0, 'amplitude; 0: no pulse, kicks take the walls out', unit='cells', low=0.0, high=5.0
    )
    sigma: float = describe_time(5.0, 'standard deviation of the envelope', low=0.1, high=1e4)
    settle: float = describe_time(200.0, 'wait until the walls have left and the waves have faded')


def fire_clearing_pulse(element: Memory, how: Drive) -> Procedure[None]:
    """Bring back ends that strayed, fire the pulse, and let the walls leave and its waves decay;
    raises as `Instrument.require_phase`.
    """
    settings = element.settings.clearing_pulse
    yield from bring_ends_back(element)
    end = End(settings.end)
    element.require_phase(end)
    element.begin_cycle('cleared')
    rest = element.transducer.measure_rest(end)
    yield from move_end(element, end, Pulse(rest, settings))
    element.last_moved = element.ticks
    yield from wait(element, settings.settle)


def moves_from(design: Design, settings: Settings, start: int, target: int) -> Iterator[Move]:
    """Yield the clearing pulse of a register, if it has one; kicks clear the others."""
    if settings.holds_words and settings.clearing_pulse.A:
        pulse = settings.clearing_pulse
        duration = pulse_duration(pulse) + pulse.settle
        blank = blank_content(settings)
        yield Move('clearing pulse', start, blank, duration, fire_clearing_pulse)
