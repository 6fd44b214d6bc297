# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Ours: a wall that goes back: a throw, a stroke down, and the windows of both."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from matplotlib.colors import LinearSegmentedColormap

from mlmem_ros.device.motion import Cycle
from mlmem_ros.device.moves import How, Move, cycle_of, throw_cycle
from mlmem_ros.device.presets import preset
from mlmem_ros.device.reading import BLANK
from mlmem_ros.device.settings import ActuatorSettings, Settings
from mlmem_ros.physics import Chain, Design, Specimen
from mlmem_ros.physics.equilibrium import resting_wall
from mlmem_tools.checks.bare import moved

from ...designer.stroke_search import FAR, reach, shortest_ease, stretched
from ...studies import style
from ...studies.trace import strain_chain
from ..figure import Data, Figure, Quality

FIGURE = Figure(
    'back',
    'A wall that goes back: a throw, a stroke, and their windows',
    seconds=90,
)

THROWN, STRUCK = 5, 11
"""Levels from which the two pictures set out."""

STRONG = ActuatorSettings(max_strain=0.5, max_rate=1.0)
"""An actuator that no point of the maps asks too much of."""


def timed(times: Any, peak: float, ease: float) -> Any:
    """Return a throw with factors on its peak and on its release time."""
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
    figure = style.new_figure(7.4)
    upper, lower = figure.subfigures(2, 1, height_ratios=(1.1, 1.0))
    panels = style.stacked(upper, 2)
    kinds = (('throw', 'case_2', 'a throw takes the wall out'),
             ('stroke', 'bits_4', f'a stroke from {STRUCK} to {STRUCK - 1}'))  # fmt: skip
    for (above, below), letter, (kind, name, text) in zip(panels.T, 'ab', kinds, strict=True):
        design, t = preset(name).design, data[f'{kind}_t']
        mesh = style.contour(above, t, design.sites, data[f'{kind}_field'])
        above.set(ylabel='cell $j$')
        style.label(above, letter, text)
        style.schedule(below, t, data[f'{kind}_strain'])
        below.set(xlabel='time $t$ (time units)', xlim=(t[0], t[-1]))
    style.phase_bar(upper, mesh, panels[0, 1], (design.D_s1, design.D_s2))
    design, settings = preset('bits_4')
    left, right = style.axes_grid(lower, 1, 2, sharex=True, sharey=True)[0]
    factors, throw = data['factors'], settings.throw
    colors = LinearSegmentedColormap.from_list('share', [style.PALE, style.S2], N=5)
    for axes, name in ((left, 'thrown'), (right, 'struck')):
        mesh = style.window(axes, factors, data[name], 0.3, colors)
    left.set(xlim=(factors[0], factors[-1]), ylim=(factors[0], factors[-1]))
    fine = np.linspace(factors[0], factors[-1], 100)
    change = (1.0 - throw.ease_to) * throw.peak
    slips = [shortest_ease(design, change * p) / throw.ease for p in fine]
    slack = [reach(design, change * p, throw.ease) / FAR for p in fine]
    left.plot(fine, slips, color=style.INK, label='far end slips below')
    left.plot(fine, slack, color=style.INK, ls='--', label=f'flight = {FAR:g} X')
    left.set(xlabel='peak (relative)', ylabel='release time (relative)')
    right.set(xlabel='peaks (relative)', ylabel='all times (relative)')
    lower.legend(*left.get_legend_handles_labels(), loc='outside lower left', ncols=2)
    style.label(left, 'c', 'blanked by one throw')
    style.label(right, 'd', 'odd levels down by one')
    bar = figure.colorbar(mesh, ax=[left, right], pad=0.01, ticks=[0.0, 0.5, 1.0])
    bar.ax.set_yticklabels(['none', 'half', 'all'])
    return figure
