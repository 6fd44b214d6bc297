# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Ours: the independent check, every quantity by a second route that shares no code with it.

SciPy's DOP853 on the equations as printed, closed forms, the continuum's wall and minimisers:
see `second_route`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...studies.style import INK, S1, S2, axes_grid, label, new_figure
from ..figure import Data, Figure, Judged, Quality, judged
from ..second_route import dynamics, statics

FIGURE = Figure(
    'check',
    'The independent check: SciPy, closed forms, Newton',
    caption='Lower panel: relative differences of the table below.',
    seconds=15,
)


@FIGURE.data
def compute(quality: Quality) -> Data:
    """Return the table, and two histories by both routes: a write's wall and an echo."""
    data: Data = {}
    rows = [
        *statics.potential(),
        *statics.waves(quality),
        *statics.continuum(),
        statics.kink_fit(quality),
        *statics.static(quality),
        *dynamics.dynamics(quality, data),
    ]
    data['quantity'] = np.array([row.quantity for row in rows])
    data['ours'] = np.array([row.ours for row in rows])
    data['theirs'] = np.array([row.theirs for row in rows])
    data['route'] = np.array([row.route for row in rows])
    return data


@FIGURE.drawing
def draw(data: Data) -> Any:
    """Draw both histories by both routes, and the relative differences of the table."""
    figure = new_figure(7.2, 5.6)
    upper, lower = figure.subfigures(2, 1, height_ratios=(1.0, 2.0))
    write, echo = axes_grid(upper, 1, 2)[0]
    write.plot(data['t'], data['wall_theirs'], color=S1, lw=2.2, label='SciPy DOP853')
    write.plot(data['t'], data['wall_ours'], color=INK, lw=0.7, label='kernel')
    write.set(xlabel='time $t$', ylabel='wall $X$ (cells)')
    write.legend()
    label(write, 'a', 'a write cycle')
    echo.semilogy(data['t_echo'], data['v_c_theirs'], color=S1, lw=2.2)
    echo.semilogy(data['t_echo'], data['v_c_ours'], color=INK, lw=0.7)
    echo.set(xlabel='time $t$', ylabel='$v_c$', ylim=(1e-6, 2e-2))
    label(echo, 'b', 'an echo')
    axes = axes_grid(lower)[0, 0]
    relative = np.abs(data['ours'] - data['theirs']) / np.maximum(np.abs(data['theirs']), 1e-300)
    y = np.arange(len(relative))[::-1]
    axes.hlines(y, 1e-16, np.maximum(relative, 1e-16), color='0.8', lw=0.8)
    axes.semilogx(np.maximum(relative, 1e-16), y, 'o', color=S2, ms=3.5)
    axes.set_yticks(y, data['quantity'], fontsize=6)
    axes.set(xlabel='relative difference of the two routes', xlim=(1e-16, 10.0))
    label(axes, 'c', 'every quantity by two routes')
    return figure


# --- claims ------------------------------------------------------------------------------------


@FIGURE.claim(
    'Eq. (1) is integrated by the scheme of Noh and Bathe',
    page=5,
    how='kernel against SciPy DOP853 over a whole write cycle and an echo',
)
def _integrator(data: Data) -> Judged:
    rows = {
        str(name): (float(ours), float(theirs))
        for name, ours, theirs in zip(data['quantity'], data['ours'], data['theirs'], strict=True)
    }
    place = abs(np.subtract(*rows['wall at the end of the schedule']))
    delay = abs(np.subtract(*rows['echo delay, wall at j = 50']))
    coarse = rows['greatest v_c of the echo x 1e3']
    fine = rows['greatest v_c x 1e3, a tenth of the step']
    loss, left = (100.0 * abs(ours / theirs - 1.0) for ours, theirs in (coarse, fine))
    return judged(
        place < 0.01 and delay < 2.0 and left < 1.0,
        f'the wall ends within {place:.1e} cells, the echo is {delay:.2f} late. At our step of '
        f'0.25 the scheme damps the echo by {loss:.0f} %; at a tenth of it by {left:.2f} %',
    )
