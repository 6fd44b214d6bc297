# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Every level of Case II written without strain: erased and kicked, over time."""

from __future__ import annotations

from typing import Any

from mlmem import Command, Erase, MemoryElement, Write, load_element
from mlmem.element_file import use_kicks
from mlmem.physics import CASE_II
from mlmem.physics.values import Array

from ...studies import style
from ...studies.trace import record_procedures
from ..figure import Data, Figure, Quality

definition = Figure('kicked', 'Every level written by a kick, after one that erases', seconds=15)


@definition.register_data
def compute_data(quality: Quality) -> Data:
    """Return frames of the configuration, and how the ends move, while all levels are written."""
    # written in this order, so that most are far from the one before; then the element is erased
    level_order = (7, 0, 6, 1, 5, 2, 4, 3)
    levels = level_order[: quality.pick(2, len(level_order))]
    element = MemoryElement(use_kicks(load_element('case_2')))
    commands: list[Command] = [*map(Write, levels), Erase()]
    trace = record_procedures(element, (('', command) for command in commands))
    return trace.list_frames(quality.pick(8, 280)) | {'begins': trace.begins, 'levels': levels}


@definition.register_drawing
def draw_figure(data: Data) -> Any:
    """Draw the configuration over time: a kick is a ramp to a level, or erases the wall."""
    t: Array = 1e-3 * data['t']
    figure = style.new_figure(3.2)
    axes = style.axes_grid(figure)[0, 0]
    mesh = style.draw_contour(axes, t, CASE_II.sites, data['field'])
    style.phase_bar(figure, mesh, axes, (CASE_II.D_s1, CASE_II.D_s2))
    for begin, level in zip(1e-3 * data['begins'], data['levels'], strict=False):
        axes.axvline(begin, color=style.Colour.FAINT, lw=0.6)
        axes.text(begin, CASE_II.N + 4, f' {level}', va='bottom')
    axes.text(1e-3 * data['begins'][-1], CASE_II.N + 4, ' blank', va='bottom')
    axes.set(xlabel=style.Label.TIME, ylabel='cell $j$', ylim=(1, CASE_II.N))
    return figure
