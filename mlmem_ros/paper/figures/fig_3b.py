# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Fig. 3b: history of v_1 with the wall at two places: pulse, echo, threshold, delay."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from ...device.echo import blanking
from ...physics import CASE_II, Specimen
from ...physics.equilibrium import resting_wall
from ...studies.style import FAINT, MARK, S1, S2, axes_grid, label, new_figure
from ..echoes import PAPER, PRINTED, probe_element
from ..figure import Data, Figure, Judged, Quality, judged

FIGURE = Figure(
    '3b',
    'Fig. 3b: a pulse and its echo from the wall',
    caption='The pulse of the paper with a carrier of 2.0 and a threshold of 7.5e-5 (i, ii), '
    'and as printed.',
    seconds=2,
)

DESIGN = dataclasses.replace(CASE_II, N=200)

LEVELS = (1, 3)
"""Walls at j = 50 and 100: cells 51 and 101 are the first inactive ones, as the paper counts."""


@FIGURE.data
def compute(quality: Quality) -> Data:
    """Return v_m, v_c and the delay for both walls, with our carrier and the printed one."""
    data: Data = {'sites': DESIGN.sites, 'states': [DESIGN.D_s1, DESIGN.D_s2]}
    for number, level in enumerate(LEVELS):
        v = resting_wall(Specimen(DESIGN), level)
        data[f'configuration_{number}'] = v
        data[f'wall_{number}'] = DESIGN.defect(level)
        for name, probe in (('ours', PAPER), ('printed', PRINTED)):
            echo = probe_element(DESIGN, v, probe, duration=900.0)
            data |= {f't_{name}': echo.t, f'v_m_{name}_{number}': echo.v_m}
            data[f'v_c_{name}_{number}'] = echo.v_c
            data[f'delay_{name}_{number}'] = np.nan if echo.delay is None else echo.delay
            data[f'pulse_v_c_{name}_{number}'] = echo.v_c.max()
            late = echo.t > blanking(probe)
            data[f'echo_v_c_{name}_{number}'] = echo.v_c[late].max()
    data |= {'v_th_ours': PAPER.v_th, 'v_th_printed': PRINTED.v_th, 'blanking': blanking(PAPER)}
    data |= {'omega_ours': PAPER.omega_c, 'omega_printed': PRINTED.omega_c}
    return {name: np.asarray(value) for name, value in data.items()}


@FIGURE.drawing
def draw(data: Data) -> Any:
    """Draw one row per wall with its inset, and the printed numbers below."""
    figure = new_figure(6.6, 4.6)
    grid = axes_grid(figure, 3, 1, sharex=True)[:, 0]
    for number, axes in enumerate(grid[:2]):
        t, wall = data['t_ours'], int(data[f'wall_{number}'])
        _history(axes, t, data[f'v_m_ours_{number}'], data[f'v_c_ours_{number}'])
        axes.axhline(data['v_th_ours'], color=MARK, lw=0.9, ls='--')
        delay = float(data[f'delay_ours_{number}'])
        axes.annotate(
            '', (0.0, 3e-2), (delay, 3e-2), arrowprops={'arrowstyle': '<->', 'lw': 0.8},
            annotation_clip=False,
        )  # fmt: skip
        axes.plot([delay, delay], [float(data['v_th_ours']), 3e-2], color='k', lw=0.7, ls=':')
        axes.text(delay + 8, 2.4e-2, rf'$\Delta t={delay:.1f}$', fontsize=8, va='center')
        label(axes, 'b.' + 'i' * (number + 1), f'wall at $j={wall}$')
        _inset(axes, data, number)
    axes = grid[2]
    _history(axes, data['t_printed'], data['v_m_printed_1'], data['v_c_printed_1'])
    _history_line(axes, data)
    label(axes, 'ours', rf'as printed, wall at $j={int(data["wall_1"])}$: nothing comes back')
    axes.set_xlabel('time $t$ since the pulse began')
    grid[0].plot([], [], color=FAINT, lw=2, label='$v_m$')
    grid[0].plot([], [], color=S2, label='$v_c$')
    grid[0].plot([], [], color=MARK, ls='--', label='threshold $v_{th}$')
    grid[0].legend(loc='lower right', ncols=3)
    return figure


def _history_line(axes: Any, data: Data) -> None:
    axes.axhline(data['v_th_printed'], color=MARK, lw=0.9, ls='--')
    text = rf'$v_{{th}}={data["v_th_printed"] * 1e3:.1f}\times10^{{-3}}$'
    axes.text(890, float(data['v_th_printed']) * 1.2, text, fontsize=7, color=MARK, ha='right')


def _history(axes: Any, t: np.ndarray, v_m: np.ndarray, v_c: np.ndarray) -> None:
    axes.semilogy(t, np.maximum(v_m, 1e-8), color=FAINT, lw=0.3, rasterized=True)
    axes.semilogy(t, np.maximum(v_c, 1e-8), color=S2, lw=1.2)
    axes.set(ylim=(1e-6, 5e-2), xlim=(0, 900), ylabel=r'$|v_1 - v_{s2}|$')
    axes.set_yticks([1e-6, 1e-4, 1e-2])


def _inset(axes: Any, data: Data, number: int) -> None:
    inset = axes.inset_axes((0.76, 0.60, 0.23, 0.36))
    v = data[f'configuration_{number}']
    inset.scatter(data['sites'], v, c=np.where(v > 0.0, S2, S1), s=1.5, linewidths=0)
    inset.set(xlim=(0, 200), ylim=(-1.5, 1.5), yticks=data['states'], xticks=(1, 100, 200))
    inset.set_yticklabels([r'$\Delta_{s1}$', r'$\Delta_{s2}$'])
    inset.tick_params(labelsize=6, length=2, pad=1)
    inset.set_facecolor('white')


# --- claims ------------------------------------------------------------------------------------


@FIGURE.claim(
    'An echo is v_c > 7.5e-3 after the pulse',
    page=5,
    where='Fig. 3b',
    how='peak of v_c with the printed pulse, A = 0.01',
    printed='threshold 7.5e-3',
)
def _printed_threshold(data: Data) -> Judged:
    pulse = max(float(data[f'pulse_v_c_{name}_1']) for name in ('ours', 'printed'))
    printed = float(data['v_th_printed'])
    return judged(
        pulse > printed and not np.isnan(data['delay_printed_1']),
        f'the pulse itself reaches v_c = {pulse:.1e} only: nothing can cross {printed:.1e}. '
        f'7.5e-5 works (`one_threshold`)',
    )


@FIGURE.claim(
    'The delay grows with the distance of the wall (Fig. 3b: j = 51 and 101)',
    page=5,
    where='Fig. 3b',
    how='N = 200, carrier 2.0, threshold 7.5e-5',
)
def _delay_grows(data: Data) -> Judged:
    near, far = float(data['delay_ours_0']), float(data['delay_ours_1'])
    return judged(
        far > near + 50.0,
        f'delays {near:.1f} and {far:.1f}: {100.0 / (far - near):.3f} cells per time unit',
    )
