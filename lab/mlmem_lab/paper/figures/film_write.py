# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Ours: a film of one step of a write: the landscape of the wall tilts, and the wall rolls on."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from mlmem_ros.checks.quasistatic import held_landscape
from mlmem_ros.device.motion import Cycle
from mlmem_ros.device.settings import WriteSettings, peak
from mlmem_ros.physics import CASE_II, Chain, Specimen
from mlmem_ros.physics.equilibrium import resting_wall

from ...studies import style
from ...studies.trace import strain_chain, wall_path
from ..figure import Data, Figure, Quality
from ..film import growing, save_film

FIGURE = Figure(
    'write',
    'A write: strain tilts the landscape of the wall',
    seconds=4,
)

LEVEL = 1
"""The step begins here: tension frees the wall."""


@FIGURE.data
def compute(quality: Quality) -> Data:
    """Return strain and wall by frame, and the landscapes at a family of strains."""
    settings, home = WriteSettings(), CASE_II.defect(LEVEL)
    largest = peak(settings, CASE_II.freed_by_compression(LEVEL))
    chain = Chain(CASE_II)
    chain.place(resting_wall(Specimen(CASE_II), LEVEL))
    trace = strain_chain(chain, Cycle.planned(settings, largest), quality.pick(400.0, 25.0))
    strains = np.linspace(0.0, largest, quality.pick(2, 9))
    landscapes = [held_landscape(CASE_II, home - 10.0, home + 35.0, e) for e in strains]
    return {
        't': trace.t,
        'strain': trace.strain,
        'wall': wall_path(CASE_II, trace.configuration),
        'X': landscapes[0].X,
        'strains': strains,
        'U': np.array([landscape.energy for landscape in landscapes]),
    }


@FIGURE.film
def save(data: Data, stem: Path) -> list[Path]:
    """Write the film; return the file."""
    figure = style.new_figure(4.2)
    upper, lower = style.axes_grid(figure, 2, 1, height_ratios=(2.0, 1.0))[:, 0]
    X, home = data['X'], CASE_II.defect(LEVEL)
    U = 1e3 * (data['U'] - data['U'][:, [np.argmin(np.abs(X - home))]])
    order = np.argsort(data['strains'])
    (line,) = upper.plot(X, U[0], color=style.INK)
    (wall,) = upper.plot([], [], 'o', color=style.S2, ms=12)
    for level in (LEVEL, LEVEL + 1):
        upper.axvline(CASE_II.defect(level), color=style.FAINT, lw=0.8, zorder=0)
    upper.set(xlim=(X[0], X[-1]), ylim=(U.min() - 5.0, U.max() + 5.0))
    upper.set(xlabel='wall $X$ (cells)', ylabel='energy $U$ ($10^{-3}$)')
    style.label(upper, 'a', 'the landscape of the wall')
    curve = growing(lower, data['t'] / 1e3, 1e3 * data['strain'])
    lower.set(xlabel=style.TIME, ylabel=style.STRAIN)
    style.label(lower, 'b', f'a cycle takes it from level {LEVEL} to {LEVEL + 1}')

    def show(frame: int) -> list[Any]:
        strain, place = data['strain'][frame], data['wall'][frame]
        now = [np.interp(strain, data['strains'][order], height) for height in U[order].T]
        line.set_ydata(now)
        wall.set_data([place], [np.interp(place, X, now)])
        return [line, wall, *curve(frame)]

    return save_film(figure, show, len(data['t']), stem)
