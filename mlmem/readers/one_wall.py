# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Reading one wall by waveform: the blank element and every level, each as forecast from the
design or from a fitted twin.

An element with strong defects returns echoes of the defects as loud as that of the wall, so no
single delay gives the level. The whole waveform does. `read.end` selects which end is driven:
`left` or `right` drives that end and compares its record alone; `both` drives the left end and
compares the records of both.
"""

from __future__ import annotations

import contextlib
import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from ..errors import ErrorCode, SettingsError
from ..instrument.end import End, Shot
from ..physics import Design, Specimen, StateError
from ..physics.held_wall import hold_walls
from ..physics.values import Array
from ..physics.waves import group_velocity, pass_band
from ..settings import Settings
from .calibration import Calibration, DelayTable
from .reading import UNDECODABLE, Unclear
from .register import Content, Forecasts, pin_contents, pin_walls
from .waveforms import Delays, Ends, Listener, simulate_answers


@dataclass(eq=False, repr=False)
class WallForecasts(Forecasts):
    """What the ends do after a pulse, for the blank element and for every level of one wall.

    Pairs of walls are forecast too, so that two walls are never read as a blank element. So are
    walls behind the last level, which name no content: between two levels the margin shows it. And
    so is every content received late by one end, which looks like another content: the right end
    alone distinguishes the upper levels of an element with strong defects.

    Attributes:
        tail_parts: Of walls behind the last level, shape (walls, lines).
        late_parts: Of every content received late, shape (delays, contents, lines).
        max_residual: Largest residual, relative to the blank element's answer.
    """

    tail_parts: Array = field(kw_only=True)
    late_parts: Array = field(kw_only=True)
    max_residual: float = field(kw_only=True)

    def find_late_content(self, part: Array, here: int) -> Content | None:
        """Return another content than that of a row which one late end would make of a part nearly
        as well; or None.

        The way from the forecast of the found content to a late one of another must be walked by
        less than 0.45, as with the margin of a read: half-way is nearer to the other one.
        `mlmem study robust_reads` counts what this refuses, and what it leaves wrong.
        """
        walls = len(self.contents[here].walls)
        alike = [
            row
            for row in range(self.late_parts.shape[1])
            if row != here and len(self.contents[row].walls) == walls
        ]
        ways = self.late_parts[:, alike] - self.parts[here]
        along = ways @ (part - self.parts[here]) / np.square(ways).sum(axis=2)
        if along.max(initial=0.0) < 0.45:
            return None
        return self.contents[alike[int(along.argmax()) % len(alike)]]

    def _judge_residual(self, part: Array, row: int, left: float) -> float:
        """Judge what the nearest content leaves; see `Forecasts`.

        Scattered cells leave a residual in every direction, most of it in none that leads to
        another content, so the residual must not exceed `max_residual` of the blank element's
        answer. A wall behind the last level is nearer to one of its own forecasts than to any
        content.
        """
        content, share = self.contents[row], left / self.pulse_size
        if content.number == UNDECODABLE:
            raise Unclear('there are two walls', len(content.walls))
        behind = np.linalg.norm(self.tail_parts - part, axis=1).min(initial=np.inf)
        if content.walls and behind < left:
            raise Unclear('the wall is behind the last level', 1)
        if late := self.find_late_content(part, row):
            raise Unclear(
                f'what is heard may be {late.number} with a late end, or {content.number}'
            )
        if share > self.max_residual:
            raise Unclear(
                f'the nearest forecast, of {content.number}, leaves {share:.3g} of the pulse; the '
                f'limit is {self.max_residual:g}'
            )
        return self.max_residual / max(share, 1e-3)


def forecast_levels(made: Specimen, settings: Settings) -> WallForecasts:
    """Return the forecasts of an element, blank and with its wall at every level.

    Raises:
        SettingsError: The wall does not rest at a level.
    """
    design = made.design
    levels = range(design.levels)
    wall_sets = [(level,) for level in levels] + list(itertools.combinations(levels, 2))
    contents, states = pin_contents(made, wall_sets)
    if missing := set(levels) - {each.number for each in contents}:
        expected = 'one that can be held: no wall rests there'
        raise SettingsError(ErrorCode.UNSUPPORTED, 'level', min(missing), expected)
    end = End.RIGHT if settings.read.end == 'right' else End.LEFT
    listener = Listener(settings, compared_ends=2 if settings.read.end == 'both' else 1)
    forecast = make_forecast(made, settings, listener, end)
    # Up to four periods of the carrier, in steps of a sixteenth of it. Later signals look like
    # none of these, and like no other content either: the pulse has passed.
    step = 2.0 * math.pi / settings.register.omega_c / 16.0
    delays: list[Delays] = [(step * count, 0.0) for count in range(1, 65)]
    if listener.compared_ends == 2:
        delays += [(0.0, delay) for delay, _ in delays]
    late_parts = forecast(states[: 1 + design.levels], delays=delays)
    return WallForecasts(
        contents, forecast(states), listener, end,
        tail_parts=forecast(list(hold_tail_walls(made))),
        late_parts=late_parts.reshape(len(delays), 1 + design.levels, -1),
        max_residual=settings.register.max_residual,
    )  # fmt: skip


def make_forecast(
    made: Specimen, settings: Settings, listener: Listener, end: End
) -> Callable[..., Array]:
    """Return the function that forecasts the answers of an element to a pulse of an end; its
    arguments are the displacements in which it rests, and delays (`Ends.compute_answers`).
    """
    if made.design.friction:
        return partial(simulate_answers, made, settings=settings, listener=listener, end=end)
    return partial(Ends(made, settings, listener).compute_answers, made, end=end)


def scale_losses(made: Specimen, factor: float) -> Specimen:
    """Return an element whose damping and friction are so many times as great."""
    design = replace(made.design, friction=factor * made.design.friction)
    return replace(made, design=design, eta_factor=factor * made.eta_factor)


def fit_loss_factor(made: Specimen, settings: Settings, forecasts: Forecasts, shot: Shot) -> float:
    """Return the factor on damping and friction with which the blank element's forecast is nearest
    to what the ends did after the pulse of some forecasts.

    Factors from 0.6 to 1.5 are compared; between them the square of the distance is taken for a
    parabola.
    """
    factors, squares = np.linspace(0.6, 1.5, 19), []
    listener, end, part = forecasts.listener, forecasts.end, forecasts.listener.project_shot(shot)
    for factor in factors:
        other = scale_losses(made, float(factor))
        forecast = make_forecast(other, settings, listener, end)
        squares.append(float(np.square(forecast([pin_walls(other, ())])[0] - part).sum()))
    nearest = int(np.clip(np.argmin(squares), 1, len(squares) - 2))
    about = slice(nearest - 1, nearest + 2)
    curvature, slope, _ = np.polyfit(factors[about], squares[about], 2)
    found = float(np.clip(-0.5 * slope / curvature, factors[0], factors[-1]))
    return round(found, 6)


def hold_tail_walls(made: Specimen) -> Iterator[Array]:
    """Yield displacements with the wall held at every cell behind the last level, from half the
    distance of two levels on: scatter may pin it there.
    """
    design = made.design
    first = design.defect_site(design.levels - 1) + 0.5 * design.J
    for position in np.arange(math.ceil(first), design.N - 1.0):
        with contextlib.suppress(StateError):  # too near the end
            yield hold_walls(made, np.array([position]), np.zeros(design.N)).v[0]


def estimate_travel_times(design: Design, settings: Settings) -> Calibration:
    """Return the time of the pulse to the wall of every level and back, at either end.

    It comes from the lower of the group velocities in the phases that pass the carrier. It says
    how long waves are inside; no level is decoded by it.

    Raises:
        SettingsError: The carrier is outside the pass band of the inactive phase.
    """
    carrier = settings.register.omega_c
    low, high = pass_band(design.k_s1)
    if not low < carrier < high:
        raise SettingsError(
            ErrorCode.CONFLICT, 'register.omega_c', carrier,
            f'inside the pass band of the inactive phase, {low:.4g} to {high:.4g}',
        )  # fmt: skip
    velocity = float(group_velocity(carrier, design.k_s1))
    low, high = pass_band(design.k_s2)
    if low < carrier < high:
        velocity = min(velocity, float(group_velocity(carrier, design.k_s2)))
    sites = [design.defect_site(level) for level in range(design.levels)]
    return Calibration(
        DelayTable(tuple(2.0 * site / velocity for site in sites)),
        DelayTable(
            tuple(2.0 * (design.N - site) / velocity for site in sites), 2.0 * design.N / velocity
        ),
    )
