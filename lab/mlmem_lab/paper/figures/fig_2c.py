# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Fig. 2c: the substrate's stiffness, Eq. (2), for the three elements of Fig. 2b."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from mlmem.physics import CASE_I

from ...studies import style
from ..figure import Data, Figure, Quality
from .fig_2b import SOFTEST_SITES

definition = Figure('2c', 'Fig. 2c: stiffness of the substrate', seconds=1)


@definition.register_data
def compute_data(quality: Quality) -> Data:
    """Return s_{j+1/2} over s_min for every j_0, shape (3, N - 1)."""
    designs = [dataclasses.replace(CASE_I, j_0=j_0) for j_0 in SOFTEST_SITES]
    return {
        'x': CASE_I.sites[:-1] + 0.5 - CASE_I.J,
        's': [design.s / design.s_min for design in designs],
        'j_0': np.array(SOFTEST_SITES) - CASE_I.J,
    }


@definition.register_drawing
def draw_figure(data: Data) -> Any:
    """Draw the three profiles under each other's columns, as the paper's second row."""
    figure = style.new_figure(2.2)
    grid = style.axes_grid(figure, 1, 3, sharey=True)[0]
    for number, axes in enumerate(grid):
        axes.plot(data['x'], data['s'][number], color=style.Colour.INK)
        axes.axvline(0.0, color=style.Colour.FAINT)
        axes.axvline(data['j_0'][number], color=style.Colour.MARK, ls='--')
        axes.set(xlabel='$x = j - 100$ (cells)', ylim=(0.8, 3.2), yticks=(1, 2, 3))
        style.label_panel(
            axes, 'c.' + 'i' * (number + 1), rf'$j_0 - 100 = {data["j_0"][number]:+.0f}$'
        )
    grid[0].set_ylabel(r'$s_{j+1/2}/s_{\min}$')
    return figure
