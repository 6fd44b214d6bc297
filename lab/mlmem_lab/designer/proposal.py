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
- eta is 1/250, or less if the farthest echo needs it.
- Peaks and times follow from what frees walls and kinks: see `schedules`. Moves down are in
  `going_back`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from mlmem_ros.device import Settings
from mlmem_ros.device.settings import ActuatorSettings, ProbeSettings, ReadSettings
from mlmem_ros.device.strokes import hand_rate
from mlmem_ros.physics import CASE_II, Design
from mlmem_tools.checks import Report, Verdict, check
from mlmem_tools.checks.subject import Subject

from .going_back import going_back
from .pulses import confirm, damping_for, listen
from .schedules import Freeing, erase_schedule, freeing, up_to, write_schedule

FEWEST, MOST = 2, 256
"""Range of levels."""

CELLS = range(7, 21)
"""Cells per level to try."""

GAMMA = -3e-5
"""Gradient per cell."""

PLACE = 0.38
"""Site of the least substrate stiffness, over its period."""

ROOM = 1.2
"""Least factor between the erase tension and what frees a kink, or a wall."""


class DesignNotFound(ValueError):
    """No design was found: the message says for what, and why."""


@dataclass(frozen=True)
class Proposal:
    """A design that passes the checker, with the settings of its instrument.

    Attributes:
        design: The element.
        settings: The instrument's settings.
        report: What the checker says.
        reasons: Why each J below the chosen one was rejected, by J.
    """

    design: Design
    settings: Settings
    report: Report
    reasons: dict[int, str]


def propose(levels: int) -> Proposal:
    """Return a design for a number of levels that passes the checker.

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
        if isinstance(found, Proposal):
            return replace(found, reasons=reasons)
        reasons[J] = found
    said = '; '.join(f'J = {J}: {why}' for J, why in reasons.items())
    raise DesignNotFound(f'no design for {levels} levels was found: {said}')


def _with(levels: int, J: int) -> Proposal | str:
    """Return a proposal with J cells per level, or the reason why there is none."""
    frees = freeing(Subject(_element(levels + 2, J, 1 / 250, 0), Settings()))
    if math.isnan(frees.room):
        return 'at some level no tension frees the kink, or the wall'
    if frees.room < ROOM:
        return (
            f'the tensions that free kink and wall are too close: {frees.kink_tension:.4f} and '
            f'{frees.wall_tension_least:.4f}'
        )
    eta = damping_for(_element(levels, J, 1 / 250, 0))
    heard = listen(_element(levels, J, eta, 0))
    if heard is None:
        return 'no pulse separates the farthest level from the clutter of the defects'
    probe, tail = heard
    design = _element(levels, J, eta, tail)
    settings = going_back(design, _settings(design, frees, probe))
    report = check(design, settings)
    if report.verdict is Verdict.FAIL:
        return '; '.join(f'{finding.name}: {finding.text}' for finding in report.of(Verdict.FAIL))
    return Proposal(design, settings, report, {})


def _element(levels: int, J: int, eta: float, tail: int) -> Design:
    return replace(
        CASE_II, N=(levels + 1) * J + tail, gamma=GAMMA, J=J, J_s=2 * J,
        j_0=round(2 * J * PLACE, 6), eta=eta, tail=tail,
    )  # fmt: skip


def _settings(design: Design, frees: Freeing, probe: ProbeSettings) -> Settings:
    """Return the settings of the instrument of a design."""
    return Settings(
        actuator=ActuatorSettings(max_strain=0.05, max_rate=2e-4, hand_rate=hand_rate(design.N)),
        write=write_schedule(design, frees),
        erase=erase_schedule(design, frees),
        probe=confirm(design),
        probe_right=probe,
        read=ReadSettings(
            end='right',
            patience=up_to(100.0, 24.0 / design.eta + 2.0 * design.N),
        ),
    )
