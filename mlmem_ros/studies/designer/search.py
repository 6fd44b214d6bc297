# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""From a number of levels to a candidate, by rules, closed forms and quick equilibria.

What is chosen, and why:

- The cell is the paper's (a, b, c, d of Case II), with beta = -1/20.
- J is the least for which an erase has room: the tension that frees a kink from level 0, which
  the free end attracts, must be well below the one that frees a wall. Fewer cells per level are
  faster to cross, and bring the farthest wall nearer.
- J_s = 2 J and j_0 = 0.38 J_s: launched walls and kinks are caught near level 0, and a wall that
  is let go has a third of the way left, which the next defect pulls it along; the gradient has
  only to keep it from turning back. gamma = -3e-5 then costs 8 % of alpha over 256 levels.
- eta is 1/250, or as much less as the farthest echo needs.
- The far end of the element is shaken by N times the strain: ramps last until its acceleration
  is small beside the pins, and some damping times.
- Peaks are 1.4 times what frees a wall; the erase tension is between those of kink and wall.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

from ...device import Settings
from ...device.checks import Report, Verdict, check
from ...device.checks.schedule import forward
from ...device.checks.subject import Subject
from ...device.settings import (
    ActuatorSettings,
    EraseSettings,
    ProbeSettings,
    ReadSettings,
    WriteSettings,
)
from ...physics import CASE_II, Design
from .listening import Listening, damping_for, listen

FEWEST, MOST = 2, 256
"""Numbers of levels that are designed for."""

CELLS = range(7, 21)
"""Cells per level that are tried."""

GAMMA = -3e-5
"""Gradient per cell."""

PLACE = 0.38
"""Site of the least substrate stiffness, over its period."""

ROOM = 1.2
"""Least factor between the erase tension and what frees a kink, or a wall."""

FORCE = 1.4
"""Peaks over what frees a wall or a kink."""

ORDER = 0.4
"""Place of the erase tension between kink and wall, as an exponent: nearer to the kink, for the
far wall is shaken by the ramp as well."""

CALM = 2e-4
"""Greatest acceleration of the far end in a ramp, in cells per time squared."""

SLOWER = 1.5
"""Ramps of an erase over those of a write: its tension has less room."""

RAMP = 1.6
"""Least ramp in damping times."""

LAUNCH_STRAIN, LAUNCH_SPEED = 0.02, 0.002
"""Under this strain an end is moved at this speed, slowly beside the damping."""


class DesignNotFound(ValueError):
    """No design was found: the message says for what, and what stood against it."""


@dataclass(frozen=True)
class Proposal:
    """A design that passes the checker, with the settings of its instrument.

    Attributes:
        design: The element.
        settings: The instrument's settings.
        listening: How the right end hears it.
        report: What the checker says.
        reasons: Why cells per level below the chosen J were not taken, by J.
    """

    design: Design
    settings: Settings
    listening: Listening
    report: Report
    reasons: dict[int, str]


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
        """Least wall tension over the kink's, its root: what either side has to spare."""
        return math.sqrt(self.wall_tension_least / self.kink_tension)


def propose(levels: int) -> Proposal:
    """Return a design for a number of levels that passes the checker.

    Args:
        levels: From 2 to 256.

    Raises:
        DesignNotFound: None was found, or levels is out of range.
    """
    if isinstance(levels, bool) or not isinstance(levels, int) or not FEWEST <= levels <= MOST:
        raise DesignNotFound(
            f'levels must be a whole number from {FEWEST} to {MOST}; got {levels!r}'
        )
    reasons: dict[int, str] = {}
    for J in CELLS:
        found = _with(levels, J)
        if isinstance(found, str):
            reasons[J] = found
            continue
        return replace(found, reasons=reasons)
    said = '; '.join(f'J = {J}: {why}' for J, why in reasons.items())
    raise DesignNotFound(f'no design for {levels} levels was found: {said}')


def _with(levels: int, J: int) -> Proposal | str:
    """Return a proposal with J cells per level, or why there is none."""
    frees = _freeing(Subject(_element(levels + 2, J, 1 / 250, 0), Settings()))
    if not frees.room >= ROOM:  # true for NaN, too
        return (
            f'what frees kink and wall is too near: {frees.kink_tension:.4f} and '
            f'{frees.wall_tension_least:.4f}'
        )
    eta = damping_for(_element(levels, J, 1 / 250, 0))
    listening = listen(_element(levels, J, eta, 0))
    if listening is None:
        return 'no pulse tells the farthest level from the clutter of the defects'
    design = _element(levels, J, eta, listening.tail)
    settings = _settings(design, frees, listening.probe)
    report = check(design, settings)
    if report.verdict is Verdict.FAIL:
        return '; '.join(f'{finding.name}: {finding.text}' for finding in report.of(Verdict.FAIL))
    return Proposal(design, settings, listening, report, {})


def _element(levels: int, J: int, eta: float, tail: int) -> Design:
    return replace(
        CASE_II, N=(levels + 1) * J + tail, gamma=GAMMA, J=J, J_s=2 * J,
        j_0=round(2 * J * PLACE, 6), eta=eta, tail=tail,
    )  # fmt: skip


def _freeing(subject: Subject) -> Freeing:
    """Return what frees walls and kinks at the start, in the middle and at the end."""
    strains = {
        kink: [forward(subject, level, kink=kink) for level in subject.steps]
        for kink in (False, True)
    }
    wall, kink = strains[False], strains[True]
    return Freeing(
        max(_sizes(wall, -1.0)),
        max(_sizes(wall, 1.0)),
        min(_sizes(wall, 1.0)),
        max(_sizes(kink, -1.0)),
        max(_sizes(kink, 1.0)),
    )


def _sizes(strains: list[float], sign: float) -> Iterator[float]:
    """Yield the sizes of the strains of one sign; NaN where a wall is not freed at all."""
    for strain in strains:
        if math.isnan(strain) or strain * sign > 0.0:
            yield abs(strain)


def _settings(design: Design, frees: Freeing, probe: ProbeSettings) -> Settings:
    """Return the settings of the instrument of a design."""
    write = WriteSettings(
        **_schedule(design, frees.wall_tension),
        compression=-_tidy(FORCE * frees.wall_compression),
        tension=_tidy(FORCE * frees.wall_tension),
        start_strain=LAUNCH_STRAIN,
        launch_speed=LAUNCH_SPEED,
    )
    kink, wall = frees.kink_tension, frees.wall_tension_least
    erase = EraseSettings(
        **_schedule(design, frees.kink_compression, SLOWER),
        compression=-_tidy(FORCE * frees.kink_compression),
        tension=_tidy(kink * (wall / kink) ** ORDER),
        start_strain=-LAUNCH_STRAIN,
        launch_speed=LAUNCH_SPEED,
    )
    return Settings(
        actuator=ActuatorSettings(max_strain=0.05, max_rate=2e-4),
        write=write,
        erase=erase,
        probe=ProbeSettings(gain_decay=0.5 * design.eta),
        probe_right=probe,
        read=ReadSettings(
            end='right',
            rest=_hundreds(1.2 * design.N),  # what runs to and fro within has crossed it
            patience=_hundreds(24.0 / design.eta + 2.0 * design.N),
        ),
    )


def _schedule(design: Design, peak: float, slower: float = 1.0) -> dict[str, float]:
    """Return ramp, hold, release and settle of a cycle.

    Args:
        design: The element.
        peak: Strain that frees what is moved.
        slower: Factor on the ramps.
    """
    damping_time = 1.0 / design.eta
    calm = math.sqrt(6.0 * FORCE * peak * design.N / CALM)
    ramp = _hundreds(slower * max(calm, RAMP * damping_time))
    hold, settle = round(0.8 * damping_time, 6), round(2.4 * damping_time, 6)
    return {'ramp': ramp, 'hold': hold, 'release': ramp, 'settle': settle}


def _hundreds(value: float) -> float:
    return 100.0 * math.ceil(value / 100.0 - 1e-9)  # what is a hundred to rounding is one


def _tidy(strain: float) -> float:
    return round(strain, 4)
