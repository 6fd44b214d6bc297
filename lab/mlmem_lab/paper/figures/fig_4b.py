# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Fig. 4b: the delay of the echo at every level, from the left as in the paper, and the right."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from typing import Any

import numpy as np

from mlmem import Settings
from mlmem.instrument.end import End
from mlmem.physics import CASE_II
from mlmem.physics.equilibrium import find_pinned_wall
from mlmem.physics.waves import group_velocity
from mlmem.settings import ProbeSettings

from ...studies import style
from ..echoes import PAPER_PROBE, probe_element
from ..figure import Data, Figure, Judged, Quality, judge_numbers

definition = Figure('4b', 'Fig. 4b: echo delay by level', seconds=1)


@definition.register_data
def compute_data(quality: Quality) -> Data:
    """Return the echo delays of all levels by three readers, and of the same with no wall; NaN
    without an echo.
    """
    levels = range(0, CASE_II.levels, quality.pick(3, 1))
    walls = [find_pinned_wall(CASE_II, level) for level in levels]
    data: Data = {'levels': levels, 'codes': [CASE_II.code(level) for level in levels]}
    # the paper's plain threshold (our reading of it), and the device's two ends
    for name, end, probe in (
        ('paper', End.LEFT, PAPER_PROBE),
        ('left', End.LEFT, Settings().probe),
        ('right', End.RIGHT, Settings().probe_right),
    ):
        echoes = [probe_element(CASE_II, v, probe, end, duration=1300.0) for v in walls]
        data[f'delay_{name}'] = np.array([echo.delay for echo in echoes], dtype=float)
        data[f'margin_{name}'] = [echo.threshold_margin for echo in echoes]
        data[f'time_of_flight_{name}'] = _flight_time(end, probe, levels)
    full = dataclasses.replace(CASE_II, N=4 * CASE_II.N, beta=0.0)
    alone = probe_element(full, np.full(full.N, full.D_s2), PAPER_PROBE, duration=1300.0)
    data['delay_without_wall'] = np.array(alone.delay, dtype=float)
    return data | {'margin_without_wall': alone.threshold_margin}


def _flight_time(end: End, probe: ProbeSettings, levels: Iterable[int]) -> np.ndarray:
    """Return 2 distance / group velocity of the carrier, without offset: Eq. (4)."""
    wall = np.array([CASE_II.defect_site(level) for level in levels])
    k_s, distance = end.k_s(CASE_II), abs(wall - end.site(CASE_II))
    return np.asarray(2.0 * distance / group_velocity(probe.omega_c, k_s))


@definition.register_drawing
def draw_figure(data: Data) -> Any:
    """Draw delay against level with its binary code."""
    figure = style.new_figure(4.2)
    axes = style.axes_grid(figure)[0, 0]
    levels, carrier = data['levels'], rf'$\omega_c={PAPER_PROBE.omega_c:g}$'
    own = rf'$\omega_c={Settings().probe_right.omega_c:g}$'
    rows = (
        ('left', style.Colour.INK, '+', 10, r'left end, $\omega_c=2.1$, falling threshold'),
        ('paper', style.Colour.ACTIVE, 'o', 7, f'left end, {carrier}, plain threshold'),
        ('right', style.Colour.INACTIVE, 's', 6, f'right end, {own} (ours)'),
    )
    for name, color, marker, size, text in rows:
        delay, flight = data[f'delay_{name}'], data[f'time_of_flight_{name}']
        axes.plot(levels, delay, marker, color=color, ms=size, label=text, mfc='none')
        if name != 'left':
            axes.plot(levels, flight + np.nanmean(delay - flight), color=color, lw=1.0, zorder=0)
    codes = zip(levels, data['codes'], strict=True)
    axes.set_xticks(levels, [f'{level}\n{code}' for level, code in codes])
    axes.set(xlabel='level and its code', ylim=(0, 1150))
    axes.set_ylabel(r'echo delay $\Delta t$ (time units)')
    axes.legend(loc='upper center')
    style.label_panel(axes, 'b', 'echo delay of every level')
    return figure


@definition.register_claim(
    'At the domain wall the wave is reflected back toward the source as an echo',
    page=5,
    how='the same probe of an element without a wall, too long to echo from its far end',
    replaced='carrier 2.0, threshold 7.5e-5',
)
def _echo_from_wall(data: Data) -> Judged:
    silent = bool(np.isnan(data['delay_without_wall']))
    heard = not np.isnan(data['delay_paper']).any()
    margin = float(data['margin_without_wall'])
    return judge_numbers(
        silent and heard,
        f'without a wall v_c stays at {margin:.2f} of the threshold after the pulse; with one '
        f'it reaches {data["margin_paper"].min():.1f} to {data["margin_paper"].max():.1f}',
    )


@definition.register_claim(
    'The delays of the eight levels are distinct and increase with the level',
    page=6,
    where='Fig. 4b',
    how='wall at rest at every defect, probed from the left; our device, and the right end, '
    'beside it',
    replaced='carrier 2.0, threshold 7.5e-5',
)
def _delays_by_level(data: Data) -> Judged:
    steps = [np.diff(data[f'delay_{name}']) for name in ('paper', 'left')]
    right = -np.diff(data['delay_right'])
    holds = all(bool(np.all(step > 20.0)) for step in steps)
    listed = ', '.join(f'{delay:.1f}' for delay in data['delay_paper'])
    return judge_numbers(
        holds,
        f'{listed}; at least {steps[0].min():.0f} apart (device: {steps[1].min():.0f}; right '
        f'end, falling with the level: {right.min():.0f})',
    )


@definition.register_claim(
    'The position may be determined by a signal initiated at either boundary',
    page=3,
    how='wall at rest at every defect, probed from the right with a carrier of 0.7, inside the '
    'band of s1 and below that of s2',
    also=('carriers',),
)
def _either_boundary(data: Data, sweep: Data) -> Judged:
    falls = -np.diff(data['delay_right'])
    at = [
        int(np.argmin(np.abs(sweep[f'omega_{e}'] - o))) for e, o in (('left', 2), ('right', 0.7))
    ]
    left, right = sweep['echo_left'][at[0]], sweep['echo_right'][at[1]]
    return judge_numbers(
        np.all(falls > 0.0),
        f'from the right the delays fall from {data["delay_right"][0]:.0f} to '
        f'{data["delay_right"][-1]:.0f}, and the weakest echo is {right.min() / left.min():.0f} '
        'times stronger than from the left',
    )


@definition.register_claim(
    'Time of flight over distance is the group velocity of the carrier',
    page=5,
    where='implied by Eq. (4)',
    how='straight line through the delays against 2 / v_g(omega_c)',
)
def _time_of_flight(data: Data) -> Judged:
    ratios = {}
    for name in ('paper', 'right'):
        levels = data['levels']
        slope = np.polyfit(levels, data[f'delay_{name}'], 1)[0]
        ratios[name] = slope / np.polyfit(levels, data[f'time_of_flight_{name}'], 1)[0]
    right = abs(ratios['right'] - 1.0) < 0.1
    left = abs(ratios['paper'] - 1.0) < 0.1
    return judge_numbers(
        right and left,
        f'right end (0.7): delays grow by {ratios["right"]:.3f} of what Eq. (4) says. Left end '
        f'(2.0): by {ratios["paper"]:.3f}, because near the band edge the slower carrier is '
        'overtaken by the lower frequencies of the pulse, which cross the threshold first',
        in_part=right,
    )
