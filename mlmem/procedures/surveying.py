# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Surveying: pulses from both ends into several states, whose waveforms tell of every cell.

A fit (`mlmem_tools.identification`) finds the element that explains them.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

from ..commands import Outcome
from ..errors import ProcedureFailed
from ..instrument.blocks import Procedure, ramp_strain, wait
from ..instrument.end import End
from ..memory import Memory
from ..moves.strain_cycle import return_to_zero
from ..physics.waves import pass_band
from ..readers.calibration import PulseCorrection
from ..readers.listening import fire_pulse, wait_for_decay
from ..readers.reading import BLANK
from ..settings import ProbeSettings
from . import writing

RECORD_TIME = 900.0
"""Time for which both ends are recorded after a pulse."""

QUIET_DAMPING_TIMES = 10.0
"""Damping times 1 / eta for which the element rests before a pulse: what is left of waves is then
fainter than the noise of a good transducer."""


class Aim(NamedTuple):
    """A pulse of a survey.

    Attributes:
        end: The driven end.
        carrier: Its place in the pass band of that end's phase, 0 to 1.
        sigma: Of its envelope.
        strain: Of the substrate while it is recorded.
    """

    end: End
    carrier: float
    sigma: float
    strain: float = 0.0


AIMS = (
    (  # no wall is there that a strain could free
        Aim(End.RIGHT, 0.30, 4.0),
        Aim(End.LEFT, 0.46, 3.0),
        Aim(End.LEFT, 0.115, 4.0, strain=-0.009),
        Aim(End.RIGHT, 0.40, 3.0, strain=0.009),
    ),
    (Aim(End.LEFT, 0.31, 5.0), Aim(End.RIGHT, 0.30, 4.0)),
    (Aim(End.LEFT, 0.31, 5.0), Aim(End.RIGHT, 0.115, 5.0), Aim(End.RIGHT, 0.30, 4.0)),
    (
        Aim(End.RIGHT, 0.46, 3.0),
        Aim(End.LEFT, 0.53, 5.0),
        Aim(End.RIGHT, 0.30, 5.0),
        Aim(End.LEFT, 0.31, 5.0),
    ),
)
"""The pulses into a blank element, and with the wall at the first level, half-way and at the last,
which were chosen for what they tell of the cells."""


def survey(element: Memory) -> Procedure[Outcome]:
    """Pulse the element in several states, record both ends, and restore the content.

    The wall is driven to a level without a look where it arrives: a fit finds that out. Without an
    actuator kicks do that, and no shot is strained.

    Raises:
        ProcedureFailed: Nothing damps the waves, the element holds words, cells are known to be
            bad, no wall can be launched, the ends do not come to rest, or the content could not
            be restored.
    """
    design = element.design
    if element.settings.holds_words:
        raise ProcedureFailed(
            'a survey drives one wall from level to level: survey a register as the same element '
            'for one wall, such as case_2 for byte'
        )
    if design.eta == 0.0:
        raise ProcedureFailed('a survey needs damping: without, the element never comes to rest')
    if element.settings.element.bad_cells:
        raise ProcedureFailed('a survey needs the whole element: element.bad_cells must be empty')
    yield from return_to_zero(element)
    content = yield from element.reader.read_settled(element)
    yield from writing.erase(element)
    blank_aims, first_aims, middle_aims, last_aims = AIMS
    yield from _record_shots(element, 0, blank_aims)
    place = yield from _launch_wall(element)
    yield from _record_shots(element, design.defect_site(place), first_aims)
    shots = len(blank_aims) + len(first_aims)
    goals = [(design.levels // 2, middle_aims), (design.levels - 1, last_aims)]
    while goals:
        level, aims = goals.pop(0)
        if level <= place:
            continue
        yield from writing.go_to_level(element, place, level)
        yield from wait_for_decay(element)
        if element.phases == (1, 0):  # the wall is between the ends
            yield from _record_shots(element, design.defect_site(level), aims)
            shots, place = shots + len(aims), level
        elif level > 1:  # try half of the way
            yield from writing.erase(element)
            place, goals = (yield from _launch_wall(element)), [(level // 2, aims)]
    restored = yield from writing.restore_content(element, content)
    return replace(restored, found={'shots': shots})


def estimate_survey(element: Memory) -> float:
    """Return the time of a survey."""
    content = max(BLANK, writing.find_content(element))
    top = max(element.reader.single_walls.values(), default=BLANK)
    each = RECORD_TIME + (QUIET_DAMPING_TIMES / element.design.eta if element.design.eta else 0.0)
    way = writing.driving_time(element, content, BLANK) + writing.driving_time(element, BLANK, top)
    return way + writing.writing_time(element, top, content) + sum(map(len, AIMS)) * each


def _launch_wall(element: Memory) -> Procedure[int]:
    """Launch a wall, harder if that fails; return the level meant."""
    as_set = element.pulse_corrections[0]
    # the wall of one element in 16 with 1 % of scatter turns back after the launch as set
    for correction in (as_set, PulseCorrection(peak=1.25, times=0.3, speed=2.0)):
        yield from writing.go_to_level(element, BLANK, 0, corrections=[correction])
        yield from wait_for_decay(element)
        if element.phases == (1, 0):  # the wall is between the ends
            return 0
        if element.phase(End.LEFT) != 0:
            yield from writing.erase(element)
    raise ProcedureFailed('no pulse launches a wall into the element')


def _record_shots(element: Memory, wall: float, aims: tuple[Aim, ...]) -> Procedure[None]:
    """Fire pulses, with carriers in the band of the phase of their end, and report the shots."""
    design, actuator, times = element.design, element.settings.actuator, element.settings.erase
    for aim in aims:
        strain = max(-actuator.max_strain, min(aim.strain, actuator.max_strain))
        strained = actuator.present and strain != 0.0
        if strained:
            yield from ramp_strain(element, strain, times.ramp)
        yield from wait_for_decay(element)
        yield from wait(element, QUIET_DAMPING_TIMES / design.eta)
        yield from _wait_for_fading(element)
        element.require_phase(aim.end)
        low, high = pass_band(design.k_s2 if wall and aim.end is End.LEFT else design.k_s1)
        # in cells: what a cell adds to an echo is still linear in it
        amplitude = 0.01
        probe = ProbeSettings(low + aim.carrier * (high - low), amplitude, aim.sigma)
        ticks = math.ceil((12.0 * probe.sigma + RECORD_TIME) / element.tick)
        shot = yield from fire_pulse(element, aim.end, probe, ticks)
        element.report_shot(replace(shot, wall=wall))
        if strained:
            yield from ramp_strain(element, 0.0, times.release)


def _wait_for_fading(element: Memory) -> Procedure[None]:
    """Wait until no earlier wave is left that a fit would hear, at most as long again."""
    transducer, step = element.transducer, 1.0 / element.design.eta
    for _ in range(round(QUIET_DAMPING_TIMES)):
        # Noise alone has up to 1.2 times its mean departure from rest. Waves of 3e-7 cells are a
        # third of those that a fit detects.
        if all(
            transducer.measure_unrest(end) <= max(1.2 * transducer.noise(end), 3e-7) for end in End
        ):
            return
        yield from wait(element, step)
