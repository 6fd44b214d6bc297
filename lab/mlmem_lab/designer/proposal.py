# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""From a number of levels to a candidate, by rules, closed forms and quick equilibria.

What is chosen, and why:

- The cell is the paper's (a, b, c, d of Case II), with beta = -1/20.
- J is the least for which an erase has room: the tension that frees a kink from level 0, which
  the free end attracts, must be well below the one that frees a wall. Fewer cells per level are
  faster to cross, and bring the farthest wall nearer.
- J_s = 2 J and j_0 = 0.38 J_s: launched walls and kinks are caught near level 0. A released wall
  has a third of the way left, along which the next defect pulls it; the gradient only has to keep
  it from turning back. gamma = -3e-5 then costs 8 % of alpha over 256 levels.
- A cell with a law of its own needs a gradient that balances the energy which every passage sets
  free (`balance_gradient`), beside that: it changes alpha by so much that few levels are left, if
  any.
- eta is 1/250, or less if the farthest echo needs it.
- Peaks and times follow from what frees walls and kinks. A write places the wall gently: up,
  hardly a hold, and nearly all the way back while the next defect pulls the wall in; no time is
  then needed to settle (docs/moving_walls.md). An erase moves kink and wall, and separates them by
  its tension, which has less margin: it goes slowly up, holds, and goes slowly back. The far end
  of an element is shaken by N times the strain: ramps are long enough that its acceleration is
  small compared with the pins, and last some damping times.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from mlmem import Settings
from mlmem.move_settings import EraseSettings, KickSettings, WriteSettings
from mlmem.physics import CASE_II, Design, Specimen
from mlmem.physics.held_wall import hold_walls, make_uniform
from mlmem.physics.waves import pass_band
from mlmem.settings import ActuatorSettings, ProbeSettings, ReadSettings, TimeSettings
from mlmem_tools.checks import Report, Verdict, check
from mlmem_tools.checks.concern import Subject
from mlmem_tools.checks.schedule import MAX_END_ACCELERATION

from .pulses import ENVELOPE_LENGTHS, HALF_WIDTH, choose_probe, confirm_probe, greatest_damping

TICK_TIME = TimeSettings().tick
"""Times of a write are whole ticks, so that the device can follow them exactly."""

WRITE_FORCE = 1.8
"""Peaks of a write over what frees a wall: either may then be 42 % off, up to 64 levels."""

MAX_WRITE_ACCELERATION = 6.3e-3
"""Greatest acceleration of the far end in a write's ramp, in cells per time squared, over the root
of eta, because ringing has until the next ramp to fade: 4e-4 with the paper's damping."""

WRITE_RAMP = 0.95
"""Least ramp of a write in damping times."""

HOLD, EASE = 0.06 / 0.34, 0.58 / 0.34
"""A write's hold and its way back, over its ramp."""

EASE_END_FRACTION = 0.03
"""Where that way ends, as a fraction of the peak; what is left is released as calmly."""

SETTLE_DAMPING_TIMES = 4.0
"""Rest after the last cycle of a write in damping times."""

ERASE_FORCE = 1.4
"""Compression of an erase over what frees a kink."""

ERASE_TENSION_EXPONENT = 0.4
"""Place of the erase tension between kink and wall, as an exponent: nearer to the kink, because
the ramp also shakes the far wall."""

ERASE_RAMP = 1.6
"""Least ramp of an erase in damping times, before it is made slower."""

ERASE_RAMP_FACTOR = 1.5
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


def freeing_strains(subject: Subject) -> Freeing:
    """Return the strains that free walls and kinks at the start, in the middle and at the end."""
    wall, kink = subject.forward(kink=False), subject.forward(kink=True)

    def strain_sizes(
        strains: dict[int, float], sign: float
    ) -> list[float]:  # with NaN, if there is one
        return [abs(each) for each in strains.values() if not each * sign <= 0.0]

    return Freeing(
        max(strain_sizes(wall, -1.0)), max(strain_sizes(wall, 1.0)), min(strain_sizes(wall, 1.0)),
        max(strain_sizes(kink, -1.0)), max(strain_sizes(kink, 1.0)),
    )  # fmt: skip


def write_schedule(design: Design, frees: Freeing) -> WriteSettings:
    """Return the cycles of a write."""
    compression, tension = WRITE_FORCE * frees.wall_compression, WRITE_FORCE * frees.wall_tension
    peak, shaken = max(compression, tension), MAX_WRITE_ACCELERATION * math.sqrt(design.eta)
    ramp = round_up(TICK_TIME, max(_calm_ramp(design, peak, shaken), WRITE_RAMP / design.eta))
    return WriteSettings(
        ramp=ramp,
        hold=round_up(TICK_TIME, HOLD * ramp),
        ease=round_up(TICK_TIME, EASE * ramp),
        ease_to=EASE_END_FRACTION,
        release=round_up(TICK_TIME, _calm_ramp(design, EASE_END_FRACTION * peak, shaken)),
        settle=0.0,
        final_settle=round_up(100.0, SETTLE_DAMPING_TIMES / design.eta),
        compression=-_round_strain(compression),
        tension=_round_strain(tension),
        start_strain=LAUNCH_STRAIN,
        launch_speed=LAUNCH_SPEED,
    )


def erase_schedule(design: Design, frees: Freeing) -> EraseSettings:
    """Return the cycles of an erase."""
    damping_time = 1.0 / design.eta
    calm = _calm_ramp(design, ERASE_FORCE * frees.kink_compression, MAX_END_ACCELERATION)
    ramp = round_up(100.0, ERASE_RAMP_FACTOR * max(calm, ERASE_RAMP * damping_time))
    kink, wall = frees.kink_tension, frees.wall_tension_least
    return EraseSettings(
        ramp=ramp,
        hold=round(0.8 * damping_time, 6),
        release=ramp,
        settle=round(2.4 * damping_time, 6),
        compression=-_round_strain(ERASE_FORCE * frees.kink_compression),
        tension=_round_strain(kink * (wall / kink) ** ERASE_TENSION_EXPONENT),
        start_strain=-LAUNCH_STRAIN,
        launch_speed=LAUNCH_SPEED,
        trust_reading=True,
    )


def _calm_ramp(design: Design, peak: float, acceleration: float) -> float:
    """Return the ramp in which a peak shakes the far end by no more than an acceleration."""
    return math.sqrt(6.0 * peak * design.N / acceleration)


def round_up(unit: float, time: float) -> float:
    """Return a time rounded up to a whole number of units."""
    return unit * math.ceil(time / unit - 1e-9)  # whole up to rounding counts as whole


def _round_strain(strain: float) -> float:
    return round(strain, 4)


FEWEST, MOST = 2, 256
"""Range of levels."""

CELLS_PER_LEVEL = range(7, 21)
"""Cells per level to try."""

GRADIENT_PER_CELL = -3e-5
"""Gradient per cell."""

MAX_ALPHA_CHANGE = 0.5
"""Most change of alpha over an element."""

STIFFNESS_MINIMUM_PLACE = 0.38
"""Site of the least substrate stiffness, over its period."""

MIN_TENSION_MARGIN = 1.2
"""Least factor between the erase tension and what frees a kink, or a wall."""


class DesignNotFound(ValueError):
    """No design was found: the message says for what, and why."""


@dataclass(frozen=True)
class Proposal:
    """A design that passes the checker, with the settings of its instrument.

    Attributes:
        reasons: Why each J below the chosen one was rejected, by J.
    """

    design: Design
    settings: Settings
    report: Report
    reasons: dict[int, str]


def balance_gradient(cell: Design) -> float:
    """Return the gradient with which a wall is drawn neither way in a chain of such cells.

    Cell by cell a wall sets an energy free, while its own energy changes by the gradient times its
    on-site part (Hellmann-Feynman). The paper's ground states are alike: 0.
    """
    chain = make_uniform(replace(cell, N=200, J=100, J_s=200, tail=0))
    v = hold_walls(Specimen(chain), np.array([100.5]), np.zeros(chain.N)).v[0]
    energy, active = chain.potential.energy, v > chain.D_barrier
    if chain.D_s2 < chain.D_s1:
        active = ~active
    first, second = float(energy(chain.D_s1)), float(energy(chain.D_s2))
    own = float((energy(v) - np.where(active, second, first)).sum())
    return (first - second) / own


def propose_design(levels: int, cell: Design = CASE_II) -> Proposal:
    """Return a design for a number of levels that passes the checker.

    Args:
        levels: The number.
        cell: A design with the law of the cells.

    Raises:
        DesignNotFound: None was found, or levels is out of range.
    """
    if isinstance(levels, bool) or not isinstance(levels, int) or not FEWEST <= levels <= MOST:
        raise DesignNotFound(
            f'levels must be a whole number from {FEWEST} to {MOST}; got {levels!r}'
        )
    drawn = balance_gradient(cell) if cell.law else 0.0
    if unfit := _reject_cells(levels, cell, drawn):
        raise DesignNotFound(f'no design for {levels} levels was found: {unfit}')
    reasons: dict[int, str] = {}
    for J in CELLS_PER_LEVEL:
        found = _propose_with(levels, J, replace(cell, gamma=GRADIENT_PER_CELL + drawn))
        if isinstance(found, Proposal):
            return replace(found, reasons=reasons)
        reasons[J] = found
    said = '; '.join(f'J = {J}: {why}' for J, why in reasons.items())
    raise DesignNotFound(f'no design for {levels} levels was found: {said}')


def _reject_cells(levels: int, cell: Design, drawn: float) -> str:
    """Return why cells are none of a memory, given the gradient that balances them."""
    first, second = (pass_band(k)[0] for k in (cell.k_s1, cell.k_s2))
    least = 2.0 * HALF_WIDTH / ENVELOPE_LENGTHS[-1]
    if second < first + least:
        return (
            f'the band of the second well must begin at least {least:.2g} above that of the '
            f'first, or no carrier tells them by an echo; they begin at {second:.3g} and '
            f'{first:.3g}, with stiffnesses of {cell.k_s2:.3g} and {cell.k_s1:.3g}'
        )
    if (most := MAX_ALPHA_CHANGE / abs(drawn) if drawn else math.inf) < (
        levels + 1
    ) * CELLS_PER_LEVEL[0]:
        return (
            f"a passage sets free {drawn:.2g} of the wall's on-site energy. A gradient of as much "
            f'a cell balances that, but changes alpha by half over {most:.0f} cells, and '
            f'{levels} levels need {(levels + 1) * CELLS_PER_LEVEL[0]}'
        )
    return ''


def _propose_with(levels: int, J: int, cell: Design) -> Proposal | str:
    """Return a proposal with J cells per level, or the reason why there is none."""
    element = partial(_build_element, cell, J=J)
    frees = freeing_strains(Subject(element(levels + 2, eta=1 / 250), Settings()))
    if math.isnan(frees.room):
        return 'at some level no tension frees the kink, or the wall'
    if frees.room < MIN_TENSION_MARGIN:
        return (
            f'the tensions that free kink and wall are too close: {frees.kink_tension:.4f} and '
            f'{frees.wall_tension_least:.4f}'
        )
    eta = greatest_damping(element(levels, eta=1 / 250))
    heard = choose_probe(element(levels, eta=eta))
    if heard is None:
        return 'no pulse separates the farthest level from the clutter of the defects'
    probe, tail = heard
    design = element(levels, eta=eta, tail=tail)
    settings = _build_settings(design, frees, probe)
    if (J, eta) == (9, 1 / 250):  # kicks of such cells are known
        settings = replace(settings, kick=nine_cell_kicks(levels))
    report = check(design, settings)
    if report.verdict is Verdict.FAIL:
        return '; '.join(f'{finding.name}: {finding.text}' for finding in report.of(Verdict.FAIL))
    return Proposal(design, settings, report, {})


def _build_element(cell: Design, levels: int, J: int, eta: float, tail: int = 0) -> Design:
    return replace(
        cell,
        N=(levels + 1) * J + tail,
        J=J,
        J_s=2 * J,
        j_0=round(2 * J * STIFFNESS_MINIMUM_PLACE, 6),
        eta=eta,
        tail=tail,
    )


def _build_settings(design: Design, frees: Freeing, probe: ProbeSettings) -> Settings:
    return Settings(
        actuator=ActuatorSettings(max_strain=0.05, max_rate=2e-4, hand_rate=hand_rate(design.N)),
        write=write_schedule(design, frees),
        erase=erase_schedule(design, frees),
        probe=confirm_probe(design),
        probe_right=probe,
        read=ReadSettings(
            end='right',
            settle_timeout=round_up(100.0, 24.0 / design.eta + 2.0 * design.N),
        ),
    )


def hand_rate(N: int) -> float:
    """Return the strain rate in 1/time at which a strain set by hand keeps the content of N cells.

    Measured on every preset: below the strain that frees its wall, none is lost at this rate, some
    at twice the rate. A longer substrate sways longer.
    """
    return min(5e-5, float(f'{0.016 / N:.1e}'))


NINE_CELL_SPEEDS = (0.002, 0.0039, 0.007, 0.0106, 0.0146, 0.0191, 0.0241)
"""Speeds of kicks with eta = 1/250, to every level whose kick bears a change of at least 0.1."""


def nine_cell_kicks(levels: int) -> KickSettings:
    """Return the kicks of an element of nine cells a level with eta = 1/250, as `mlmem study
    kicks` found them: the end is fastest late, which widens the windows at high speeds.
    """
    speeds = ' '.join(f'{speed:g}' for speed in NINE_CELL_SPEEDS[:levels])
    return KickSettings(speeds, late=0.7, erase_settle=1600.0)
