# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Ours: a wall that goes back: a throw, a stroke down, and the windows of both."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from matplotlib.colors import ListedColormap

from ...analysis.bare import moved
from ...analysis.designer.stroke_search import stretched
from ...analysis.throws import reach, shortest_ease
from ...device.motion import Cycle
from ...device.moves import How, Move, cycle_of, throw_cycle
from ...device.presets import preset
from ...device.reading import BLANK
from ...device.settings import ActuatorSettings, Settings
from ...physics import Chain, Design, Specimen
from ...physics.equilibrium import resting_wall
from ...studies.style import FAINT, INK, MARK, axes_grid, contour, label, new_figure, phase_bar
from ...studies.trace import strain_chain
from ..figure import Data, Figure, Quality

FIGURE = Figure(
    'back',
    'A wall that goes back: a throw, a stroke, and their windows',
    caption="(a) A throw takes the wall of the paper's element out from level 5. (b) A stroke "
    'takes that of bits_4 from level 11 to 10. (c) Share of the levels of bits_4 that one throw '
    'blanks. '
    '(d) Share of its odd levels that a stroke takes down by exactly one. Crosses: as shipped; '
    'dotted: 0.3 from there. Lines: closed forms. going_back.md tells more.',
    seconds=90,
)

THROWN, STRUCK = 5, 11
"""Levels from which the two pictures set out."""

FAR = 2.5
"""`reach` from which throws were found to blank: pins, gradient, first push take the rest."""


STRONG = ActuatorSettings(max_strain=0.5, max_rate=1.0)
"""An actuator that no point of the maps asks too much of."""


def timed(times: Any, peak: float, ease: float) -> Any:
    """Return a throw with factors on its peak and on the time of letting go."""
    return dataclasses.replace(times, peak=times.peak * peak, ease=times.ease * ease)


@FIGURE.data
def compute(quality: Quality) -> Data:
    """Follow a throw and a stroke, and map how far peak and times of both may be off.

    Returns:
        Of `throw` and `stroke` t, strain and field; factors on the peak and on the time, shapes
        (m,) and (n,), of the maps; and these, shares from 0 to 1 of shape (n, m).
    """
    case_2, bits_4 = preset('case_2'), preset('bits_4')
    down = Move(How.STROKE, STRUCK, STRUCK - 1, 0.0)
    data = _followed('throw', case_2.design, throw_cycle(case_2.settings, 0), THROWN)
    data |= _followed('stroke', bits_4.design, cycle_of(*bits_4, down), STRUCK)
    factors = quality.pick(np.array([0.7, 1.0, 1.3]), np.round(np.arange(0.4, 1.85, 0.1), 2))
    data['factors'] = factors
    every = quality.pick(5, 1)
    data['thrown'] = np.array([[_thrown(*bits_4, p, t, every) for p in factors] for t in factors])
    data['struck'] = np.array([[_struck(*bits_4, p, t, every) for p in factors] for t in factors])
    return data


def _followed(name: str, design: Design, cycle: Cycle, level: int) -> Data:
    chain = Chain(design)
    chain.place(resting_wall(Specimen(design), level))
    trace = strain_chain(chain, cycle, 5.0)
    return {
        f'{name}_t': np.array(trace.t),
        f'{name}_strain': np.array(trace.strain),
        f'{name}_field': np.array(trace.configuration, dtype=np.float32),
    }


def _thrown(design: Design, settings: Settings, peak: float, ease: float, every: int) -> float:
    throw = timed(settings.throw, peak, ease)
    cycle = throw_cycle(dataclasses.replace(settings, throw=throw, actuator=STRONG), 0)
    levels = range(0, design.levels, every)
    return float(np.mean([moved(design, cycle, level, dt=1.0) == BLANK for level in levels]))


def _struck(design: Design, settings: Settings, peak: float, time: float, every: int) -> float:
    odd = stretched(settings.down_odd, peak, time)
    changed = dataclasses.replace(settings, down_odd=odd, actuator=STRONG)
    levels = range(settings.down_odd.lowest, design.levels, 2 * every)
    cycles = [cycle_of(design, changed, Move(How.STROKE, at, at - 1, 0.0)) for at in levels]
    return float(
        np.mean(
            [moved(design, c, at, dt=1.0) == at - 1 for at, c in zip(levels, cycles, strict=True)]
        )
    )


@FIGURE.drawing
def draw(data: Data) -> Any:
    """Draw the two pictures over their strains, and the two maps."""
    figure = new_figure(7.2, 6.2)
    upper, lower = figure.subfigures(2, 1, height_ratios=(1.15, 1.0))
    panels = axes_grid(upper, 2, 2, sharex='col', height_ratios=(3.0, 1.0))
    for column, (kind, name, text) in enumerate(
        (('throw', 'case_2', f'a throw, level {THROWN} to blank'),
         ('stroke', 'bits_4', f'a stroke, level {STRUCK} to {STRUCK - 1}'))
    ):  # fmt: skip
        design = preset(name).design
        t, above, below = data[f'{kind}_t'], panels[0, column], panels[1, column]
        field = np.clip(data[f'{kind}_field'], -2.0, 2.0)
        mesh = contour(above, t, design.sites, field)
        above.set(ylabel='cell $j$')
        label(above, 'ab'[column], text)
        below.plot(t, 1e3 * data[f'{kind}_strain'], color=INK, lw=0.8)
        below.axhline(0.0, color=FAINT, lw=0.5)
        below.set(xlabel='time $t$', ylabel=r'$\varepsilon\times10^3$', xlim=(t[0], t[-1]))
    phase_bar(upper, mesh, panels[0, 1], (design.D_s1, design.D_s2))
    design, settings = preset('bits_4')
    left, right = axes_grid(lower, 1, 2)[0]
    factors, throw = data['factors'], settings.throw
    colors = ListedColormap(['#e8e8e8', '#c9d8ea', '#93b5d8', '#5b8fc2', '#2a66a5'])
    for axes, name in ((left, 'thrown'), (right, 'struck')):
        mesh = axes.pcolormesh(
            factors, factors, data[name], cmap=colors, vmin=0, vmax=1, shading='nearest'
        )
        angle = np.linspace(0.0, 2.0 * np.pi, 100)
        axes.plot(1.0 + 0.3 * np.cos(angle), 1.0 + 0.3 * np.sin(angle), ':', color=INK, lw=0.8)
        axes.plot(1.0, 1.0, '+', color=MARK, ms=9, mew=2)
        axes.set(xlim=(factors[0], factors[-1]), ylim=(factors[0], factors[-1]))
        axes.set_aspect('equal')
    fine = np.linspace(factors[0], factors[-1], 100)
    slips = [shortest_ease(design, throw.peak * p) / throw.ease for p in fine]
    slack = [reach(design, throw.peak * p, throw.ease) / FAR for p in fine]
    left.plot(fine, slips, color=INK, lw=1.0, label='far end slips below')
    left.plot(fine, slack, color=INK, lw=1.0, ls='--', label=f'reach {FAR:g} below')
    left.legend(loc='upper left', fontsize=6)
    left.set(xlabel='peak, over its own', ylabel='time of letting go, over its own')
    right.set(xlabel='peaks, over their own', ylabel='all times, over their own')
    label(left, 'c', 'blanked by one throw')
    label(right, 'd', 'odd levels down by one')
    bar = figure.colorbar(mesh, ax=[left, right], pad=0.01, ticks=[0.0, 0.5, 1.0])
    bar.ax.set_yticklabels(['none', 'half', 'all'])
    return figure
