# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The strain cycles of a design: peaks, from what frees its walls, and times.

- A write places the wall gently: up, hardly a hold, and nearly all the way back while the next
  defect pulls the wall in. No time is then needed to settle (docs/presets.md).
- An erase moves kink and wall, and separates them by its tension, which has less margin: it goes
  slowly up, holds, and goes slowly back.
- The far end of an element is shaken by N times the strain: ramps are long enough that its
  acceleration is small compared with the pins, and last some damping times.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from mlmem_ros.device.settings import EraseSettings, TimeSettings, WriteSettings
from mlmem_ros.physics import Design
from mlmem_tools.checks.schedule import CALM
from mlmem_tools.checks.subject import Subject

TICK = TimeSettings().tick
"""Times of a write are whole ticks, so that the device can follow them exactly."""

WRITE_FORCE = 1.8
"""Peaks of a write over what frees a wall: either may then be 42 % off, up to 64 levels."""

WRITE_CALM = 6.3e-3
"""Greatest acceleration of the far end in a write's ramp, in cells per time squared, over the root
of eta, because ringing has until the next ramp to fade: 4e-4 with the paper's damping."""

WRITE_RAMP = 0.95
"""Least ramp of a write in damping times."""

HOLD, EASE = 0.06 / 0.34, 0.58 / 0.34
"""A write's hold and its way back, over its ramp."""

EASE_TO = 0.03
"""Where that way ends, as a fraction of the peak; what is left is released as calmly."""

QUIET = 4.0
"""Rest after the last cycle of a write in damping times."""

ERASE_FORCE = 1.4
"""Compression of an erase over what frees a kink."""

ORDER = 0.4
"""Place of the erase tension between kink and wall, as an exponent: nearer to the kink, because
the ramp also shakes the far wall."""

ERASE_RAMP = 1.6
"""Least ramp of an erase in damping times, before it is made slower."""

SLOWER = 1.5
"""Ramps of an erase over those that leave the far end calm: its tension has less room."""

LAUNCH_STRAIN, LAUNCH_SPEED = 0.02, 0.002
"""Under this strain an end is moved at this speed, slow compared with the damping."""


@dataclass(frozen=True)
class Freeing:
    """Strains that free a wall or a kink at the hardest of the sampled levels, as sizes."""

    wall_compression: float
    wall_tension: float
    wall_tension_least: float
    kink_compression: float
    kink_tension: float

    @property
    def room(self) -> float:
        """Root of the least wall tension over the kink's: the margin on either side."""
        return math.sqrt(self.wall_tension_least / self.kink_tension)


def freeing(subject: Subject) -> Freeing:
    """Return the strains that free walls and kinks at the start, in the middle and at the end."""
    wall, kink = subject.forward(kink=False), subject.forward(kink=True)

    def sizes(strains: dict[int, float], sign: float) -> list[float]:  # with NaN, if there is one
        return [abs(each) for each in strains.values() if not each * sign <= 0.0]

    return Freeing(
        max(sizes(wall, -1.0)), max(sizes(wall, 1.0)), min(sizes(wall, 1.0)),
        max(sizes(kink, -1.0)), max(sizes(kink, 1.0)),
    )  # fmt: skip


def write_schedule(design: Design, frees: Freeing) -> WriteSettings:
    """Return the cycles of a write."""
    compression, tension = WRITE_FORCE * frees.wall_compression, WRITE_FORCE * frees.wall_tension
    peak, shaken = max(compression, tension), WRITE_CALM * math.sqrt(design.eta)
    ramp = up_to(TICK, max(_calm(design, peak, shaken), WRITE_RAMP / design.eta))
    return WriteSettings(
        ramp=ramp,
        hold=up_to(TICK, HOLD * ramp),
        ease=up_to(TICK, EASE * ramp),
        ease_to=EASE_TO,
        release=up_to(TICK, _calm(design, EASE_TO * peak, shaken)),
        settle=0.0,
        final_settle=up_to(100.0, QUIET / design.eta),
        compression=-_tidy(compression),
        tension=_tidy(tension),
        start_strain=LAUNCH_STRAIN,
        launch_speed=LAUNCH_SPEED,
    )


def erase_schedule(design: Design, frees: Freeing) -> EraseSettings:
    """Return the cycles of an erase."""
    damping_time = 1.0 / design.eta
    calm = _calm(design, ERASE_FORCE * frees.kink_compression, CALM)
    ramp = up_to(100.0, SLOWER * max(calm, ERASE_RAMP * damping_time))
    kink, wall = frees.kink_tension, frees.wall_tension_least
    return EraseSettings(
        ramp=ramp,
        hold=round(0.8 * damping_time, 6),
        release=ramp,
        settle=round(2.4 * damping_time, 6),
        compression=-_tidy(ERASE_FORCE * frees.kink_compression),
        tension=_tidy(kink * (wall / kink) ** ORDER),
        start_strain=-LAUNCH_STRAIN,
        launch_speed=LAUNCH_SPEED,
        trust_reading=True,
    )


def _calm(design: Design, peak: float, acceleration: float) -> float:
    """Return the ramp in which a peak shakes the far end by no more than an acceleration."""
    return math.sqrt(6.0 * peak * design.N / acceleration)


def up_to(unit: float, time: float) -> float:
    """Return a time rounded up to a whole number of units."""
    return unit * math.ceil(time / unit - 1e-9)  # whole up to rounding counts as whole


def _tidy(strain: float) -> float:
    return round(strain, 4)
