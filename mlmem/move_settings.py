# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What can be set on the moves of a wall: cycles of strain, and motions of an end.

Times are in time units sqrt(m / k_r), strains are Delta l / l of the element, tension positive.
The defaults are for the paper's Case II element.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

from .errors import Checked
from .schema import describe_field, make_field_factory

_time = make_field_factory('time', 0.0, 1e6)
_speed = make_field_factory('cells/time', 1e-4, 10.0)
_part = make_field_factory('', 0.0, 1.0)
_count = make_field_factory('', 1, 100)
_strain = make_field_factory('', -0.5, 0.5)
_compression = make_field_factory('', -0.5, -1e-6)
_tension = make_field_factory('', 1e-6, 0.5)


def _parse_numbers(text: str) -> tuple[float, ...]:
    return tuple(map(float, text.split()))


def _describe_levels(text: str, least: str = '1e-4') -> Any:
    """Return a field of numbers, one for each level from 0 on."""
    return describe_field(
        '',
        text,
        words=f'0 or from {least} to 10',
        word=lambda word: not float(word) or float(least) <= float(word) <= 10.0,
    )


@dataclass(frozen=True)
class CycleSettings(Checked):
    """One strain cycle: ramp to the peak, hold, ramp back, settle. Ramps are smooth.

    The way back can pause at a fraction of the peak: a wall that was freed quickly swings in a
    well that becomes shallow before it is released.
    """

    ramp: float = _time(1200.0, 'ramp to the peak strain', low=1.0)
    hold: float = _time(600.0, 'hold at the peak strain')
    ease: float = _time(0.0, 'ramp from the peak to the pause on the way back; 0: no pause')
    ease_to: float = _part(0.5, 'strain of that pause, as a fraction of the peak', low=-1.0)
    release: float = _time(1200.0, 'ramp back to zero strain', low=1.0)
    settle: float = _time(1500.0, 'wait after the cycle')


@dataclass(frozen=True)
class WriteSettings(CycleSettings):
    """Launch, step and verify."""

    method: str = describe_field(
        'strain',
        'strain: by strain cycles; kick: by kicks, with strain only where no kick reaches; auto: '
        'whichever is fastest',
        choices=('strain', 'kick', 'auto'),
    )
    compression: float = _compression(
        -0.034, 'peak strain at levels where compression frees the wall'
    )
    tension: float = _tension(0.048, 'peak strain at levels where tension frees the wall')
    start_strain: float = _strain(0.035, 'strain under which the wall is launched', low=0.0)
    launch_speed: float = _speed(0.05, 'speed of the boundary cell')
    final_settle: float = _time(
        0.0,
        'longest extra wait after the last cycle of a write, until the waves are small',
    )
    last_release: float = _time(
        0.0,
        'shortest ramp back to zero strain in the last cycle of a write',
    )
    shaped: bool = describe_field(
        False,
        'make each ramp of a step up in two halves, half a period of the cells at the right end '
        'apart, so that the cells ring less',
    )
    attempts: int = _count(3, 'most attempts of a write')
    escalation: float = describe_field(
        1.1, 'factor on the peak strains at each further attempt', low=1.0, high=2.0
    )
    escalation_limit: float = describe_field(1.35, 'largest such factor', low=1.0, high=4.0)
    min_margin: float = _part(0.5, 'least level margin of a written level', high=0.99)
    kick_tries: int = _count(
        20,
        'most kicks with which a calibration looks for the speed of a level',
        high=20,
    )


@dataclass(frozen=True)
class EraseSettings(CycleSettings):
    """The kink that is driven across: a wall and a kink need opposite strains.

    The tension frees the kink but not the wall, so that the kink catches up with it.
    """

    compression: float = _compression(
        -0.042, 'peak strain at levels where compression frees the kink'
    )
    tension: float = _tension(0.026, 'peak strain at levels where tension frees the kink')
    start_strain: float = _strain(-0.03, 'strain under which the kink is launched', high=0.0)
    launch_speed: float = _speed(0.05, 'speed of the boundary cell')
    trust_reading: bool = describe_field(
        False, 'probe for a blank element once the kink is at the level last read'
    )


def select_peak(cycles: WriteSettings | EraseSettings, compress: bool) -> float:
    """Return the peak strain that frees a wall or a kink by compression, or by tension."""
    return cycles.compression if compress else cycles.tension


@dataclass(frozen=True)
class KickSettings(Checked):
    """The motions of the left end that need no strain.

    One sends a wall from blank to the level that its speed selects. The opposite one erases: it
    sends a kink that meets the wall at any level, and both are gone.
    """

    speeds: str = _describe_levels(
        'mean speed in cells/time for every level, separated by spaces; 0: no kick to this level'
    )
    kinks: str = _describe_levels('the same for kinks of a register')
    speed_margins: str = _describe_levels(
        'relative margin of the speed of every level; one below 0.1 disables its level',
        least='0',
    )
    late: float = _part(
        0.0,
        'when the end is fastest: 0 half-way through the motion, 1 latest',
    )
    hold: float = _time(20.0, 'hold at the other ground state')
    settle: float = _time(800.0, 'wait until the wall stops at its level')
    erase_speed: float = describe_field(
        0.3,
        'mean speed of the kick that erases one wall from any level; 0: no kick erases',
        unit='cells/time',
        low=0.0,
        high=10.0,
    )
    erase_settle: float = _time(1400.0, 'wait after that kick before the next one')

    @cached_property
    def peak_speed_ratio(self) -> float:
        """Highest speed of a kick, relative to its mean: 1.5 if it is fastest half-way."""
        if not self.late:
            return 1.5
        s = [k / 1000.0 for k in range(1001)]
        x = [each + self.late * each * (each - 1.0) for each in s]
        return max(
            6.0 * y * (1.0 - y) * (1.0 + self.late * (2.0 * each - 1.0))
            for each, y in zip(s, x, strict=True)
        )

    @cached_property
    def wall_speeds(self) -> tuple[float, ...]:
        """Mean speeds of walls by level; 0 where there is no kick."""
        return _parse_numbers(self.speeds)

    @cached_property
    def kink_speeds(self) -> tuple[float, ...]:
        """Mean speeds of kinks by level."""
        return _parse_numbers(self.kinks)

    def speed_margin(self, level: int) -> float:
        """Relative change of the speed that the kick to a level tolerates; 1 if not known."""
        margins = _parse_numbers(self.speed_margins)
        return margins[level] if level < len(margins) else 1.0


@dataclass(frozen=True)
class ClearingPulseSettings(Checked):
    """The strong pulse that clears a register: all its walls leave at the left end."""

    end: str = describe_field('right', 'end that is driven', choices=('left', 'right'))
    omega_c: float = describe_field(0.8, 'carrier frequency', unit='rad/time', low=1e-3, high=10.0)
    A: float = describe_field(
        0.0, 'amplitude; 0: no pulse, kicks take the walls out', unit='cells', low=0.0, high=5.0
    )
    sigma: float = _time(5.0, 'standard deviation of the envelope', low=0.1, high=1e4)
    settle: float = _time(200.0, 'wait until the walls have left and the waves have faded')
