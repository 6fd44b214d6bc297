# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Fig. 4a: the wall driven from level to level by strain cycles, as the device does it."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from mlmem import MemoryElement, Settings, Write
from mlmem.physics import CASE_II
from mlmem.settings import TimeSettings

from ...studies import style
from ...studies.trace import record_procedures, wall_path
from ..figure import Data, Figure, Judged, Quality, judge_numbers

definition = Figure('4a', 'Fig. 4a: the wall driven from level to level', seconds=3)


@definition.register_data
def compute_data(quality: Quality) -> Data:
    """Write level 0, then go up one level at a time; note field, strain and wall.

    Returns:
        Data with t, strain, field (one row per tick), wall, and per write its level, success,
        attempts and the ticks it took.
    """
    levels = quality.pick(range(4), range(CASE_II.levels))
    tick = quality.pick(20.0, 10.0)
    settings = dataclasses.replace(Settings(), time=TimeSettings(tick=tick))
    element = MemoryElement(CASE_II, settings)
    element.perform(Write(0))  # the paper's figure begins with the wall at level 0
    trace = record_procedures(element, (('', Write(level)) for level in levels[1:]))
    data, begun = trace.list_frames(), np.array(trace.begins)
    return data | {
        't': data['t'] - begun[0],
        'wall': wall_path(CASE_II, trace.configuration),
        'begun': begun - begun[0],
        'levels': levels[1:],
        'attempts': [outcome.attempts for outcome in trace.outcomes],
        'read': [o.reading.level if o.reading else -2 for o in trace.outcomes],
    }


@definition.register_drawing
def draw_figure(data: Data) -> Any:
    """Draw contour over strain schedule, and the step from x = 0 with its four numbers."""
    figure = style.new_figure(4.6)
    left, right = figure.subfigures(1, 2, width_ratios=(2.1, 1.0))
    t = data['t'] / 1e3
    upper, lower = style.draw_driven(left, t, CASE_II, data['field'], data['strain'])
    upper.plot(t, data['wall'] - style.MIDDLE_SITE, color=style.Colour.INK, lw=0.8)
    style.mark_printed_walls(upper, [(t[0], -75.0), (t[-1], 100.0)])
    upper.legend(loc='lower right', labelcolor='w')
    style.label_panel(upper, 'a.i', r'configuration $\Delta_j$')
    style.label_panel(lower, 'a.ii', 'strain: compression below 0')
    _draw_detail(right, data)
    return figure


def _draw_detail(figure: Any, data: Data) -> None:
    """Draw the step that begins at x = 0: position and strain against time, numbered."""
    steps = list(data['levels'])
    detail_level = 3  # the step of the inset starts at this level: x = 0, as in the paper
    step = steps.index(detail_level + 1) if detail_level + 1 in steps else len(steps) - 1
    home = CASE_II.defect_site(int(steps[step]) - 1) - style.MIDDLE_SITE
    begin = data['begun'][step]
    chosen = (data['t'] >= begin) & (data['t'] <= begin + 4200.0)
    t, wall = (data['t'][chosen] - begin) / 1e3, data['wall'][chosen] - style.MIDDLE_SITE
    upper, lower = style.stacked_axes(figure)[:, 0]
    style.draw_contour(upper, t, CASE_II.sites - style.MIDDLE_SITE, data['field'][chosen])
    upper.plot(t, wall, color=style.Colour.INK, lw=1.0)
    for y in (home, home + 25.0):
        upper.axhline(y, color=style.Colour.INK, lw=0.8, ls=':')
    style.mark_printed_walls(upper, [(t[0], home), (t[-1], home + 25.0)])
    upper.set(ylim=(home - 8.0, home + 33.0), ylabel='$x$ (cells)')
    for number, (when, where) in enumerate(_find_events(t, wall, home), 1):
        box = {'boxstyle': 'circle,pad=0.15', 'fc': 'w', 'lw': 0.8}
        style.annotate_place(
            upper, str(number), (when, where), (0, -15), ha='center', va='center', bbox=box
        )
    style.label_panel(upper, 'inset', f'from $x={home:.0f}$')
    style.draw_schedule(lower, t, data['strain'][chosen])
    lower.set(xlabel='$t$ (1000)', ylabel='')


def _find_events(t: np.ndarray, wall: np.ndarray, home: float) -> list[tuple[float, float]]:
    """Return where (1) it leaves, (2) is held under strain, (3) drifts on, (4) is pinned."""
    leaves = int(np.argmax(wall > home + 2.0))
    held = int(np.argmin(np.abs(t - (t[leaves] + 0.5))))
    drifts = len(wall) - 1 - int(np.argmax(wall[::-1] < home + 21.0))
    pinned = int(np.argmin(np.abs(t - (t[drifts] + 0.6))))
    return [(float(t[i]), float(wall[i])) for i in (leaves, held, drifts, pinned)]


@definition.register_claim(
    'The opposite effect manifests in the vicinity of s_max',
    page=4,
    where='not shown',
    how='held wall in Case II, whose s_max lie inside (j = 42, 92 ...): where a wall strained '
    'to the peak of a write comes to rest',
)
def _extrema_at_s_max(data: Data) -> Judged:
    compression = -data['strain']
    peak = compression > 0.999 * compression.max()
    # at the end of every hold at the peak
    at_peak = data['wall'][:-1][peak[:-1] & ~peak[1:]]
    s_max = CASE_II.j_0 + CASE_II.J_s * (0.5 + np.arange(CASE_II.N // CASE_II.J_s))
    apart = np.array([np.abs(s_max - place).min() for place in at_peak])
    return judge_numbers(
        bool(len(apart)) and bool(apart.max() < 2.0),
        f'compressed walls are held at j = {", ".join(f"{x:.1f}" for x in at_peak)}: minima of U '
        f'within {apart.max():.1f} cells of s_max',
    )


@definition.register_claim(
    'Cycles of compressive, tensile and zero strain advance the wall level by level',
    page=5,
    where='Fig. 4a',
    how='the device writes the levels upward, each verified by an echo',
)
def _level_by_level(data: Data) -> Judged:
    right = data['success'] & (data['read'] == data['levels'])
    tries = int(data['attempts'].max())
    return judge_numbers(
        bool(right.all()) and tries == 1,
        f'{int(right.sum())} of {len(right)} steps at the first try',
    )


@definition.register_claim(
    'Events (1) to (4): de-pinning, temporary re-pinning under strain, drift by the gradient as '
    'the strain falls, pinning at the next defect',
    page=6,
    where='Fig. 4a inset',
    how="the wall's path in the write of Fig. 4a",
)
def _four_events(data: Data) -> Judged:
    held, final, worst = [], [], 0.0
    begun = [*data['begun'], data['t'][-1] + 1.0]
    for start, stop, level in zip(begun[:-1], begun[1:], data['levels'], strict=True):
        inside = (data['t'] >= start) & (data['t'] < stop)
        strain, wall = np.abs(data['strain'][inside]), data['wall'][inside]
        peak = np.flatnonzero(strain > 0.999 * strain.max())
        home = CASE_II.defect_site(int(level) - 1)
        held.append(float(wall[peak[-1]] - home))
        final.append(float(wall[-1] - home))
        worst = max(worst, abs(final[-1] - CASE_II.J))
    between = all(10.0 < h < 22.0 for h in held)
    return judge_numbers(
        between and worst < 0.5,
        f'at the peak the wall is held {min(held):.1f} to {max(held):.1f} cells on (the extrema '
        f'of s are 17 on), and ends within {worst:.2f} cells of the next defect',
    )
