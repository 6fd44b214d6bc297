# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Ours: a film of a read: a pulse runs to the wall, and its echo comes back."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from mlmem_ros.device import Settings
from mlmem_ros.device.echo import threshold
from mlmem_ros.device.pulse import Pulse
from mlmem_ros.physics import CASE_II, Chain, HeldCell, Specimen, substep_times
from mlmem_ros.physics.equilibrium import resting_wall

from ...studies import style
from ..echoes import probe_element
from ..figure import Data, Figure, Quality
from ..film import cells, growing, save_film

FIGURE = Figure(
    'read',
    'A read: a pulse and its echo',
    seconds=1,
)

LEVEL = 3

EVERY = 4.0
"""Time units between frames."""


@FIGURE.data
def compute(quality: Quality) -> Data:
    """Return displacements from rest by frame, the envelope v_c at the left end, its threshold."""
    probe, v = Settings().probe, resting_wall(Specimen(CASE_II), LEVEL)
    chain = Chain(CASE_II)
    chain.place(v)
    pulse, steps, moved = Pulse(chain.end(1), probe), round(EVERY / chain.dt), []
    t = EVERY * np.arange(1.0, quality.pick(10.0, 150.0) + 1.0)
    for end in t:
        times = end - EVERY + substep_times(steps, chain.dt)
        held = pulse.at(times[times <= pulse.duration])
        chain.advance(np.zeros(2 * steps), HeldCell(1, held) if held.size else None)
        moved.append(chain.v - v)
    echo = probe_element(CASE_II, v, probe, duration=t[-1])
    return {
        't': t,
        'moved': np.array(moved, dtype=np.float32),
        'rest': v,
        'v_c': np.interp(t, echo.t, echo.v_c),
        'threshold': threshold(probe, t),
        'delay': np.nan if echo.delay is None else echo.delay,
    }


@FIGURE.film
def save(data: Data, stem: Path) -> list[Path]:
    """Write the film; return the file."""
    figure = style.new_figure(3.8)
    upper, lower = style.axes_grid(figure, 2, 1, height_ratios=(1.4, 1.0))[:, 0]
    moved = 1e3 * data['moved']
    dots = cells(upper, CASE_II, moved, np.broadcast_to(data['rest'], moved.shape))
    upper.set(ylim=(-6.0, 6.0), ylabel=r'$\Delta v_j$ ($10^{-3}$ cells)', xlabel='cell $j$, level')
    style.label(upper, 'a', f'a pulse is reflected by the wall at level {LEVEL}')
    curve = growing(lower, data['t'], np.maximum(data['v_c'], 1e-7))
    lower.plot(data['t'], data['threshold'], color=style.MARK, ls='--')
    lower.axvline(data['delay'], color=style.S2)
    lower.set(xlabel='time since the pulse began (time units)', ylabel='$v_c$ (cells)')
    lower.set(yscale='log', ylim=(3e-6, 1e-2))
    style.label(
        lower, 'b', f'signal at the left end: an echo after {data["delay"]:.0f} time units'
    )

    def show(frame: int) -> list[Any]:
        return [*dots(frame), *curve(frame)]

    return save_film(figure, show, len(data['t']), stem)
