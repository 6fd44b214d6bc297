# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How every figure looks: the paper's colours, small type, one way to save."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

S1 = '#c8102e'
"""The inactive phase: the paper's red."""

S2 = '#1f4e9c'
"""The active phase: the paper's blue."""

COMPRESSION = '#7b3294'
TENSION = '#008837'
INK = '#222222'
FAINT = '#b8b8b8'
MARK = '#e08214'
"""Thresholds and other user settings."""

PHASES = 'RdBu'
"""Colour map of the configuration: red s1, blue s2."""

SETTINGS: Any = {
    'font.size': 8.0,
    'axes.titlesize': 8.5,
    'axes.titlelocation': 'left',
    'axes.linewidth': 0.6,
    'axes.spines.top': False,
    'axes.spines.right': False,
    'xtick.major.width': 0.6,
    'ytick.major.width': 0.6,
    'lines.linewidth': 1.1,
    'legend.frameon': False,
    'legend.fontsize': 7.0,
    'svg.fonttype': 'none',
    'svg.hashsalt': 'mlmem_ros',
}

DPI = 120


def styled() -> AbstractContextManager[None]:
    """Return the context in which figures are drawn and saved."""
    return mpl.rc_context(SETTINGS)


def new_figure(width: float, height: float) -> Any:
    """Return an empty Matplotlib figure (its types are too narrow); sizes in inches."""
    return Figure(figsize=(width, height), layout='constrained')


def axes_grid(figure: Figure, rows: int = 1, columns: int = 1, **options: Any) -> np.ndarray:
    """Return a grid of axes, shape (rows, columns)."""
    return np.asarray(figure.subplots(rows, columns, squeeze=False, **options))


def save_figure(figure: Figure, stem: Path) -> list[Path]:
    """Write a figure as PNG and SVG, the same bytes for the same data; return the files."""
    png, svg = stem.with_suffix('.png'), stem.with_suffix('.svg')
    figure.savefig(png, dpi=DPI, metadata={'Software': None})
    figure.set_layout_engine('none')  # or the layout would change for the SVG
    figure.savefig(svg, dpi=2 * DPI, metadata={'Date': None})
    return [png, svg]


def label(axes: Any, text: str, title: str = '') -> None:
    """Title a panel in the paper's style: (a) in bold, then what it shows."""
    axes.set_title(rf'$\bf{{({text})}}$ {title}', loc='left')


def contour(axes: Any, t: np.ndarray, x: np.ndarray, field: np.ndarray) -> Any:
    """Draw an x-t contour of the configuration, as Fig. 4a.

    Args:
        axes: Where to draw.
        t: Times, shape (m,).
        x: Positions, shape (N,).
        field: Configuration, shape (m, N).

    Returns:
        The mesh, for a colour bar.
    """
    return axes.pcolormesh(
        t, x, field.T, cmap=PHASES, vmin=-1.3, vmax=1.3, shading='nearest', rasterized=True
    )


def phase_bar(figure: Any, mesh: Any, axes: Any, states: Sequence[float]) -> Any:
    """Add a colour bar whose ticks are the two ground states, and return it."""
    bar = figure.colorbar(mesh, ax=axes, ticks=[states[0], 0.0, states[1]], shrink=0.7, pad=0.01)
    bar.ax.set_yticklabels([r'$\Delta_{s1}$', '0', r'$\Delta_{s2}$'])
    bar.outline.set_linewidth(0.4)
    return bar
