# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Fig. 3b: history of v_1 with the wall at two places: pulse, echo, threshold, delay."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from mlmem.physics import CASE_II
from mlmem.physics.equilibrium import find_pinned_wall

from ...studies import style
from ..echoes import PAPER_PROBE, PRINTED_PROBE, probe_element
from ..figure import Data, Figure, Judged, Quality, judge_numbers

definition = Figure('3b', 'Fig. 3b: a pulse and its echo from the wall', seconds=2)

SHORT_DESIGN = dataclasses.replace(CASE_II, N=200)


@definition.register_data
def compute_data(quality: Quality) -> Data:
    """Return v_m, v_c and the delay for both walls, with our carrier and the printed one."""
    data: Data = {}
    # walls at j = 50 and 100: cells 51 and 101 are the first inactive ones, as the paper counts
    wall_levels = (1, 3)
    for number, level in enumerate(wall_levels):
        v = find_pinned_wall(SHORT_DESIGN, level)
        data[f'wall_{number}'] = SHORT_DESIGN.defect_site(level)
        for name, probe in (('ours', PAPER_PROBE), ('printed', PRINTED_PROBE)):
            echo, wave = probe_element(SHORT_DESIGN, v, probe, duration=900.0), f'{name}_{number}'
            data |= {f't_{name}': echo.t, f'v_m_{wave}': echo.v_m, f'v_c_{wave}': echo.v_c}
            data[f'delay_{wave}'] = np.array(echo.delay, dtype=float)  # NaN for none
    return data | {'v_th_ours': PAPER_PROBE.v_th, 'v_th_printed': PRINTED_PROBE.v_th}


@definition.register_drawing
def draw_figure(data: Data) -> Any:
    """Draw one row per wall, and the printed numbers below."""
    figure = style.new_figure(5.8)
    grid = style.axes_grid(figure, 3, 1, sharex=True, sharey=True)[:, 0]
    rows = (('b.i', 'ours', 0, ''), ('b.ii', 'ours', 1, ''),
            ('ours', 'printed', 1, ', carrier and threshold as printed'))  # fmt: skip
    for axes, (letter, name, number, text) in zip(grid, rows, strict=True):
        wave = f'{name}_{number}'
        t, v_m, v_c = data[f't_{name}'], data[f'v_m_{wave}'], data[f'v_c_{wave}']
        limit, delay = float(data[f'v_th_{name}']), float(data[f'delay_{wave}'])
        axes.semilogy(
            t,
            np.maximum(v_m, 1e-8),
            color=style.Colour.FAINT,
            lw=0.4,
            rasterized=True,
            label='$v_m$',
        )
        axes.semilogy(t, np.maximum(v_c, 1e-8), color=style.Colour.ACTIVE, label='$v_c$')
        if name == 'ours':
            axes.axhline(limit, color=style.Colour.MARK, ls='--', label='threshold $v_{th}$')
        printed = float(data['v_th_printed'])
        axes.axhline(printed, color=style.Colour.PRINTED, ls='--', label=style.Label.PRINTED)
        if np.isfinite(delay):
            axes.plot(
                [0.0, delay, delay],
                [2.5e-2, 2.5e-2, limit],
                color=style.Colour.INK,
                lw=1.0,
                ls=':',
            )
            style.annotate_place(
                axes, rf'delay $\Delta t={delay:.1f}$', (delay, 2.5e-2), (4, -1), va='center'
            )
        axes.set(ylim=(1e-6, 5e-2), xlim=(0, 900), ylabel='$|v_1 - v_{s2}|$')
        axes.set_yticks([1e-6, 1e-4, 1e-2])
        wall = data[f'wall_{number}']
        style.label_panel(axes, letter, rf'wall at $j={wall:.0f}$ (printed: {wall + 1:.0f}){text}')
    grid[2].set_xlabel('time $t$ since the pulse began (time units)')
    handles, _ = grid[1].get_legend_handles_labels()
    grid[2].legend(handles=handles, loc='center right', ncols=2)
    return figure


@definition.register_claim(
    'An echo is v_c > 7.5e-3 after the pulse',
    page=5,
    where='Fig. 3b',
    how='peak of v_c with the printed pulse, A = 0.01',
    printed='threshold 7.5e-3',
)
def _printed_threshold(data: Data) -> Judged:
    pulse = max(float(data[f'v_c_{name}_1'].max()) for name in ('ours', 'printed'))
    printed = float(data['v_th_printed'])
    return judge_numbers(
        pulse > printed and not np.isnan(data['delay_printed_1']),
        f'the pulse itself reaches v_c = {pulse:.1e} only: nothing can cross {printed:.1e}. '
        f'7.5e-5 works (`one_threshold`)',
    )


@definition.register_claim(
    'The delay grows with the distance of the wall (Fig. 3b: j = 51 and 101)',
    page=5,
    where='Fig. 3b',
    how='N = 200',
    replaced='carrier 2.0, threshold 7.5e-5',
)
def _delay_grows(data: Data) -> Judged:
    near, far = float(data['delay_ours_0']), float(data['delay_ours_1'])
    return judge_numbers(
        far > near + 50.0,
        f'delays {near:.1f} and {far:.1f}: {100.0 / (far - near):.3f} cells per time unit',
    )
