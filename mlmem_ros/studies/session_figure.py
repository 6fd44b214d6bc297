# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The picture of a session: configuration over time, strain, echoes, delays."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..device.echo import threshold
from ..device.end import read_from
from ..device.units import Units
from ..session.data import RecordedEcho, SessionData
from ..session.redecode import calibration_of
from .style import (
    FAINT,
    INK,
    MARK,
    S2,
    axes_grid,
    contour,
    label,
    mark_defects,
    new_figure,
    phase_bar,
    schedule,
    stacked,
    styled,
)

ROWS = 8
"""Most echoes that are shown; of more levels every second, third ..."""


def draw(session: SessionData, path: str | Path) -> Path:
    """Draw a session and save it.

    Above, as Fig. 4a, the x-t contour of the configuration over the strain; below, as Figs. 3b
    and 4b, the last echo of every level that was read, or verified after a write, with its
    threshold, and the delays by level.

    Args:
        session: What was recorded.
        path: File to write; its suffix selects the format.

    Returns:
        The path.
    """
    with styled():
        figure_of(session).savefig(path)
    return Path(path)


def figure_of(session: SessionData) -> Any:
    """Return the picture of a session; see `draw`."""
    end = read_from(session.settings)[0]
    heard = session.reads(end, ('read', 'write'))
    last = {int(values['level']): (echo, float(values['delay'])) for echo, values in heard}
    reads = {level: last[level] for level in sorted(last) if level >= 0}
    chosen = list(reads)[:: -(-len(reads) // ROWS) or 1]
    height = 0.8 + 0.45 * max(3, len(chosen))
    figure = new_figure(4.2 + height)
    upper, lower = figure.subfigures(2, 1, height_ratios=(4.2, height))
    _draw_history(upper, session)
    left, right = lower.subfigures(1, 2, width_ratios=(1.5, 1.0))
    panels = axes_grid(left, max(1, len(chosen)), sharex=True)[:, 0]
    found = 'last echoes' if reads else 'no echo gave a level'
    label(panels[0], 'b', f'{found}, {end} end (cells)')
    probe = end.probe(session.settings)
    for axes, level in zip(panels, chosen, strict=False):
        echo, delay = reads[level]
        _draw_echo(axes, echo, threshold(probe, echo.t), delay)
        axes.set_ylabel(session.design.code(level), rotation=0, ha='right', va='center')
    panels[-1].set_xlabel('time since the pulse (time units)')
    left.legend(*panels[0].get_legend_handles_labels(), loc='outside lower center', ncols=4)
    _draw_delays(axes_grid(right)[0, 0], session, {level: d for level, (_, d) in reads.items()})
    return figure


def _draw_history(figure: Any, session: SessionData) -> None:
    design = session.design
    upper, lower = stacked(figure)[:, 0]
    if session.configuration:
        field = np.array(session.configuration)
        mesh = contour(upper, np.array(session.field_time), design.sites, field)
        mark_defects(upper, design)
        upper.set_ylabel('site $j$, level')
        phase_bar(figure, mesh, upper, (design.D_s1, design.D_s2))
    else:  # of a real element
        upper.set_axis_off()
    what = 'configuration' if session.configuration else 'configuration not recorded'
    label(upper, 'a', f'{session.node}, {design.levels} levels, {design.N} cells: {what}')
    length = Units(design, session.settings.scale).elongation
    schedule(lower, np.array(session.strain_time), np.array(session.end_displacement) / length)
    lower.set_xlabel('time (s)')


def _draw_echo(axes: Any, echo: RecordedEcho, limit: np.ndarray, delay: float) -> None:
    axes.semilogy(echo.t, np.maximum(echo.v_m, 1e-9), color=FAINT, lw=0.4, label='$v_m$')
    axes.semilogy(echo.t, np.maximum(echo.v_c, 1e-9), color=S2, label='$v_c$')
    axes.semilogy(echo.t, limit, color=MARK, ls='--', label='threshold')
    axes.axvline(delay, color=INK, lw=1.0, label='delay')
    axes.set(ylim=(3e-6, 2e-2), yticks=[1e-5, 1e-3])


def _draw_delays(axes: Any, session: SessionData, delays: dict[int, float]) -> None:
    calibration = calibration_of(session)
    calibrated = calibration.table(calibration.ends[0]).delays
    axes.plot(range(len(calibrated)), calibrated, '+', color=INK, ms=10, label='calibrated')
    axes.plot(list(delays), list(delays.values()), 'o', color=S2, ms=5, label='measured')
    axes.set(xlabel='level', ylabel=r'echo delay $\Delta t$ (time units)')
    axes.legend()
    label(axes, 'c', 'delay of every level')
