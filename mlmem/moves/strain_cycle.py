# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Strain cycles, as in the paper: launch a wall at level 0, step it up by a level, and drive a
kink across that takes the wall away.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

from ..errors import ProcedureFailed
from ..instrument.blocks import Procedure, catch_up, follow_ramps, move_end
from ..instrument.end import End, EndMove
from ..instrument.motion import Cycle, CycleSettings
from ..physics import Design
from ..readers.calibration import PulseCorrection
from ..readers.reading import BLANK, UNDECODABLE, Reading, describe_level
from ..schema import describe_field, describe_time, make_field_factory
from .move import Drive, Move, bring_ends_back

if TYPE_CHECKING:
    from ..instrument.instrument import Instrument
    from ..memory import Memory
    from ..settings import Settings

_speed = make_field_factory('cells/time', 1e-4, 10.0)
_count = make_field_factory('', 1, 100)
_strain = make_field_factory('', -0.5, 0.5)
_compression = make_field_factory('', -0.5, -1e-6)
_tension = make_field_factory('', 1e-6, 0.5)


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
    final_settle: float = describe_time(
        0.0,
        'longest extra wait after the last cycle of a write, until the waves are small',
    )
    last_release: float = describe_time(
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
    min_margin: float = describe_field(
        0.5, 'least level margin of a written level', low=0.0, high=0.99
    )
    kick_tries: int = _count(
        20,
        'most kicks with which a calibration looks for the speed of a level',
        high=20,
    )

    @property
    def uses_kicks(self) -> bool:
        """Whether kicks may move one wall; those of a register are always kicked."""
        return self.method != 'strain'

    @property
    def avoids_strain(self) -> bool:
        """Whether strain is used only where no kick reaches."""
        return self.method == 'kick'


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


def launch_first_wall(element: Memory, how: Drive) -> Procedure[None]:
    """Move the left end under a strain; a wall rests at level 0 then. Raises `NotFollowed`."""
    element.begin_cycle()
    write, limit = element.settings.write, element.settings.actuator.max_strain
    write = correct_write(write, how.corrections[0], limit)
    yield from launch_wall(element, write, element.design.D_s2)


def step_up(start: int, element: Memory, how: Drive) -> Procedure[None]:
    """Take the wall up by a level with one strain cycle, gently if it is read after it; raises
    `NotFollowed`.
    """
    design, actuator, write = element.design, element.settings.actuator, element.settings.write
    element.begin_cycle()
    if how.is_last:
        write = replace(write, release=max(write.release, write.last_release))
    limit = actuator.max_strain
    write = correct_write(write, how.corrections[start + 1], limit)
    peak = how.strain_factor * select_peak(write, design.is_freed_by_compression(start))
    cycle = Cycle.plan_cycle(write, max(-limit, min(peak, limit)), actuator.max_rate)
    yield from follow_ramps(element, cycle, half_period(design) if write.shaped else 0.0)


def drive_kink(element: Memory, how: Drive) -> Procedure[Reading]:
    """Launch a kink and drive it on by strain cycles until it meets the wall, and both vanish.

    At the same site a kink needs the opposite strain of a wall. A probe from the right end shows
    whether the wall is gone: then the echo comes from the far end. With `erase.trust_reading` it
    first listens when the kink is where the wall was read.

    Raises:
        ProcedureFailed: The element is not blank after two cycles per level.
    """
    settings, design = element.settings.erase, element.design
    cycles = 2 * design.levels + 2
    kink, meeting = 0, _cycles_until_meeting(element)
    for _ in range(cycles):
        yield from bring_ends_back(element, (End.RIGHT, End.LEFT))
        if element.phase(End.LEFT) != 0:
            element.begin_cycle()
            yield from launch_wall(element, settings, design.D_s1)
            if kink:  # launched again: the prediction no longer holds
                kink = meeting = 0
        late = kink - meeting
        # read after each of the first cycles, then at intervals that grow by an eighth: a read
        # takes as long as one cycle or several
        if late >= 0 and late % max(1, late // 8) == 0:
            reading = yield from element.reader.read(element)
            if reading.level == BLANK:
                return reading
        element.begin_cycle()
        peak = select_peak(settings, not design.is_freed_by_compression(kink % 2))
        yield from follow_ramps(element, Cycle.plan_cycle(settings, peak))
        kink += 1
    raise ProcedureFailed(
        f'the element is not blank after {cycles} strain cycles; read last: '
        f'{describe_level(reading.level)}'
    )


def moves_from(design: Design, settings: Settings, start: int, target: int) -> Iterator[Move]:
    """Yield the moves of one wall by strain."""
    if not settings.actuator.present or settings.holds_words:
        return
    write, rate = settings.write, settings.actuator.max_rate
    if start == BLANK:
        moving = abs(design.D_s2 - design.D_s1) / write.launch_speed
        cycle = Cycle.plan_cycle(write, write.start_strain, rate)
        duration = cycle.duration + moving
        yield Move('launch', BLANK, 0, duration, launch_first_wall, needs_actuator=True)
        return
    if 0 <= start < design.levels - 1:
        cycle = Cycle.plan_cycle(write, write.tension, rate)
        yield Move(
            'step up', start, start + 1, cycle.duration, partial(step_up, start),
            needs_actuator=True,
        )  # fmt: skip
    kink = Cycle.plan_cycle(settings.erase, settings.erase.compression, rate)
    place = design.levels - 1 if start == UNDECODABLE else start
    duration = (place + 2) * kink.duration + ringing_time(design)
    yield Move('kink drive', start, BLANK, duration, drive_kink, needs_actuator=True, listens=True)


def half_period(design: Design) -> float:
    """Return half a period of the inactive cells swinging in phase, as after a ramp.

    At that band edge waves do not propagate; they ring at the right end until damped.
    """
    return math.pi / math.sqrt(design.k_s1)


def ringing_time(design: Design) -> float:
    """Return how long an element rings after a fast move; 0 if it never stops."""
    # damping times after which the waves of a fast motion do not disturb a read
    return 12.0 / design.eta if design.eta > 0.0 else 0.0


def launch_wall(
    element: Instrument, times: WriteSettings | EraseSettings, target: float
) -> Procedure[None]:
    """Under a strain, move v_1 to another ground state at constant speed, and release it."""
    rise, *rest = Cycle.plan_cycle(times, times.start_strain).motions
    yield from follow_ramps(element, Cycle((rise,)))
    yield from catch_up(element)  # where is the end?
    start = element.transducer.find_displacement(End.LEFT)
    yield from move_end(element, End.LEFT, EndMove(start, target, times.launch_speed))
    yield from follow_ramps(element, Cycle(tuple(rest)))


def return_to_zero(element: Memory) -> Procedure[None]:
    """Bring a strain that was set by hand back to zero, and let the element settle.

    With the slow times of an erase: a write may return within a tick.
    """
    if element.actuator.strain != 0.0 or element.actuator.is_moving:
        element.forget_content('strained by a procedure')
        yield from follow_ramps(
            element, Cycle.plan_release(element.settings.erase, element.actuator.strain)
        )


def _cycles_until_meeting(element: Memory) -> int:
    """Return after how many cycles the kink meets the wall, if known, to listen from then on.

    The kink begins at level 0 and advances one level per cycle. A wall that compression frees
    has also moved by then; with short levels the two attract from one level apart.
    """
    reading = element.reading
    if not element.settings.erase.trust_reading or reading is None or reading.level < 1:
        return 0
    return reading.level - 1 + element.design.is_freed_by_compression(reading.level)


def correct_write(
    write: WriteSettings, correction: PulseCorrection, limit: float = math.inf
) -> WriteSettings:
    """Return the cycle of a write times a correction; its strains stay within a limit."""
    values: dict[str, Any] = {
        'launch_speed': min((correction.speed or 1.0) * write.launch_speed, 10.0)
    }
    for name in ('compression', 'tension', 'start_strain'):
        values[name] = max(-limit, min(correction.peak * getattr(write, name), limit))
    for name in ('ramp', 'hold', 'ease', 'release', 'settle'):
        values[name] = correction.times * getattr(write, name)
    return replace(write, **values)
