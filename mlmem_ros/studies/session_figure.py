# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The picture of a session: configuration over time, strain schedule, echoes, delays."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..device.echo import threshold
from ..device.end import End, read_from
from ..device.units import Units
from ..session.data import SessionData
from ..session.redecode import calibration_of
from .style import contour, new_figure, phase_bar

Reads = dict[int, tuple[Any, dict[str, str]]]
"""The last echo and the decoded values of every level that was read."""


def draw(session: SessionData, path: str | Path) -> Path:
    """Draw a session and save it.

    Args:
        session: What was recorded.
        path: File to write; its suffix selects the format.

    Returns:
        The path.
    """
    figure_of(session).savefig(path, dpi=130)
    return Path(path)


def figure_of(session: SessionData) -> Any:
    """Return the picture of a session.

    On the left, as Fig. 4a, the x-t contour of the configuration over the strain schedule. On the
    right, as Figs. 3b and 4b, the last echo of every level that was read, or verified after a
    write, with its threshold; below, the delays by level.

    Args:
        session: What was recorded.
    """
    figure = new_figure(14.0, 7.5)
    left, right = figure.subfigures(1, 2, width_ratios=(1.5, 1.0))
    field_axes, strain_axes = left.subplots(2, 1, sharex=True, height_ratios=(3.0, 1.0))
    _draw_field(left, field_axes, session)
    _draw_strain(strain_axes, session)
    end = read_from(session.settings)[0]
    heard = session.reads(end, ('read', 'write'))
    last = {int(values['level']): (echo, values) for echo, values in heard}
    reads = {level: last[level] for level in sorted(last) if level >= 0}
    rows = max(1, len(reads))
    grid = right.add_gridspec(rows + 3, 1)
    _draw_echoes(right, grid, session, end, reads)
    _draw_delays(right.add_subplot(grid[rows:, 0]), session, reads)
    figure.suptitle(
        f'{session.node}: {session.design.levels} levels, {session.design.N} cells', fontsize=11
    )
    return figure


def _draw_field(figure: Any, axes: Any, session: SessionData) -> None:
    design = session.design
    if not session.configuration:  # of a real element, or not recorded
        axes.set_title('(a) configuration: not recorded', loc='left', fontsize=10)
        return
    field = np.array(session.configuration)
    mesh = contour(axes, np.array(session.field_time), design.sites, field)
    defects = [design.defect(level) for level in range(design.levels)]
    for defect in defects:
        axes.axhline(defect, color='k', lw=0.4, alpha=0.35)
    axes.set_yticks(defects)
    axes.set_ylabel('site j (lines: defects)')
    codes = [design.code(level) for level in range(design.levels)]
    axes.secondary_yaxis('right').set_yticks(defects, codes)
    axes.set_title('(a) configuration: blue active, red inactive', loc='left', fontsize=10)
    bar = phase_bar(figure, mesh, axes, (design.D_s1, design.D_s2))
    bar.ax.set_title(r'$\Delta_j$', fontsize=10)


def _draw_strain(axes: Any, session: SessionData) -> None:
    length = Units(session.design, session.settings.scale).elongation
    strain = np.array(session.end_displacement) / length
    axes.plot(session.strain_time, 1e3 * strain, color='k', lw=0.9)
    axes.axhline(0.0, color='grey', lw=0.4)
    axes.set(xlabel='time in s', ylabel=r'strain $\times 10^3$')


def _draw_echoes(figure: Any, grid: Any, session: SessionData, end: End, reads: Reads) -> None:
    if not reads:
        axes = figure.add_subplot(grid[0, 0])
        axes.set_title(f'(b) no echo from the {end} end gave a level', loc='left', fontsize=10)
        axes.set_axis_off()
        return
    probe = end.probe(session.settings)
    latest = max(echo.t[-1] for echo, _ in reads.values())
    all_axes = [figure.add_subplot(grid[row, 0]) for row in range(len(reads))]
    for axes, (level, (echo, values)) in zip(all_axes, reads.items(), strict=True):
        axes.semilogy(echo.t, np.maximum(echo.v_m, 1e-9), color='0.8', lw=0.4)
        axes.semilogy(echo.t, np.maximum(echo.v_c, 1e-9), color='tab:blue', lw=1.0)
        axes.semilogy(echo.t, threshold(probe, echo.t), color='tab:red', lw=0.7, ls='--')
        axes.axvline(float(values['delay']), color='k', lw=0.8)
        axes.set(xlim=(0.0, latest), ylim=(3e-6, 2e-2), yticks=[1e-5, 1e-3])
        axes.set_ylabel(session.design.code(level), rotation=0, ha='right', va='center')
        axes.tick_params(labelbottom=axes is all_axes[-1], labelsize=7)
    title = rf'(b) last echo of each level at the {end} end, in cells: $v_m$ grey, $v_c$ blue'
    all_axes[0].set_title(title, loc='left', fontsize=10)
    text = 'time since the pulse in time units (dashed: threshold, black: delay)'
    all_axes[-1].set_xlabel(text)


def _draw_delays(axes: Any, session: SessionData, reads: Reads) -> None:
    calibration = calibration_of(session)
    calibrated = calibration.table(calibration.ends[0]).delays
    axes.plot(range(len(calibrated)), calibrated, '+', color='0.5', ms=9, label='calibrated')
    measured = [float(values['delay']) for _, values in reads.values()]
    axes.plot(list(reads), measured, 'o', ms=4, label='measured')
    axes.set(xlabel='level', ylabel=r'echo delay $\Delta t$')
    axes.legend(frameon=False, fontsize=8)
    axes.set_title('(c) delay by level', loc='left', fontsize=10)
