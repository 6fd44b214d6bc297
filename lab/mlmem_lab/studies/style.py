# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How every picture looks: readable at half its size, and without telling red from green.

The colours are those of Okabe and Ito, Color Universal Design (2008). Every picture is as wide as
a page, so that its type has one size on all pages.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from cycler import cycler
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from mlmem.physics import Design


class Colour:
    """The colours of lines and marks."""

    INACTIVE = '#d55e00'
    """The inactive phase: vermilion, for the paper's red."""
    ACTIVE = '#0072b2'
    """The active phase: blue."""
    COMPRESSION = '#cc79a7'
    TENSION = '#009e73'
    INK = '#222222'
    FAINT = '#b0b0b0'
    MARK = '#e69f00'
    """Thresholds and other settings."""
    PRINTED = '#7b1fa2'
    """Numbers that the paper prints: violet, which nothing else has."""
    PHASES = LinearSegmentedColormap.from_list(
        'phases',
        [(0.0, '#8a3d00'), (0.115, INACTIVE), (0.5, '#f7f7f7'), (0.885, ACTIVE), (1.0, '#004a75')],
    )
    """The configuration from -1.3 to 1.3: a phase at rest has the colour of its lines."""


class Label:
    """The words of axes and legends that several pictures have."""

    PRINTED = 'printed in the paper'
    TIME = 'time $t$ (1000 time units)'
    STRAIN = 'strain ($10^{-3}$)'


SMALL_FONT_SIZE_PT = 9.0
"""Size of notes, ticks and legends in points; everything else is larger."""

MIDDLE_SITE = 100.0
"""The site that the paper calls x = 0."""


def style_context() -> AbstractContextManager[None]:
    """Return the context in which figures are drawn and saved."""
    settings: Any = {
        'font.size': 10.0,
        'axes.titlesize': 10.0,
        'axes.titlelocation': 'left',
        'axes.labelsize': 10.0,
        'axes.linewidth': 0.8,
        'axes.prop_cycle': cycler(
            color=[
                Colour.ACTIVE,
                Colour.MARK,
                Colour.TENSION,
                Colour.COMPRESSION,
                '#56b4e9',
                Colour.INACTIVE,
            ]
        ),
        'axes.spines.top': False,
        'axes.spines.right': False,
        'xtick.labelsize': SMALL_FONT_SIZE_PT,
        'ytick.labelsize': SMALL_FONT_SIZE_PT,
        'lines.linewidth': 1.4,
        'legend.frameon': False,
        'legend.fontsize': SMALL_FONT_SIZE_PT,
        'legend.title_fontsize': SMALL_FONT_SIZE_PT,
        'savefig.dpi': 120,
        'svg.fonttype': 'none',
        'svg.hashsalt': 'mlmem_ros',
    }
    return mpl.rc_context(settings)


def new_figure(height: float) -> Any:
    """Return an empty Matplotlib figure (its types are too narrow) of a height in inches."""
    return Figure(figsize=(7.2, height), layout='constrained')


def axes_grid(figure: Figure, rows: int = 1, columns: int = 1, **options: Any) -> np.ndarray:
    """Return a grid of axes, shape (rows, columns)."""
    return np.asarray(figure.subplots(rows, columns, squeeze=False, **options))


def stacked_axes(figure: Figure, columns: int = 1) -> np.ndarray:
    """Return high axes above low ones that share their times, shape (2, columns)."""
    return axes_grid(figure, 2, columns, sharex='col', height_ratios=(3.0, 1.0))


def save_figure(figure: Figure, stem: Path) -> list[Path]:
    """Write a figure as PNG and SVG, the same bytes for the same data; return the files."""
    png, svg = stem.with_suffix('.png'), stem.with_suffix('.svg')
    figure.savefig(png, metadata={'Software': None})
    figure.set_layout_engine('none')  # or the layout would change for the SVG
    figure.savefig(svg, metadata={'Date': None})
    return [png, svg]


def label_panel(axes: Any, text: str, title: str = '') -> None:
    """Title a panel in the paper's style: (a) in bold, then what it shows."""
    axes.set_title(rf'$\bf{{({text})}}$ {title}', loc='left')


def annotate_place(
    axes: Any, text: str, at: tuple[Any, Any], shift: tuple[float, float] = (0, 0), **options: Any
) -> None:
    """Write beside a place in the data, shifted by points, what is there."""
    options = {'fontsize': SMALL_FONT_SIZE_PT, 'color': Colour.INK, **options}
    axes.annotate(text, at, shift, textcoords='offset points', **options)


def draw_contour(axes: Any, t: np.ndarray, x: np.ndarray, field: np.ndarray) -> Any:
    """Draw an x-t contour of the configuration, as Fig. 4a.

    Args:
        field: Configuration, shape (m, N).

    Returns:
        The mesh, for a colour bar.
    """
    max_contour_columns = 1200  # most columns of a contour: a screen shows no more
    thin = max(1, len(t) // max_contour_columns)
    return axes.pcolormesh(
        t[::thin], x, field[::thin].T, cmap=Colour.PHASES, vmin=-1.3, vmax=1.3, shading='nearest',
        rasterized=True,
    )  # fmt: skip


def draw_schedule(axes: Any, t: np.ndarray, strain: np.ndarray) -> None:
    """Draw the strain over times, shapes (m,), as the lower half of Fig. 4a."""
    axes.axhline(0.0, color=Colour.FAINT, lw=0.8)
    axes.plot(t, 1e3 * strain, color=Colour.INK, lw=1.0)
    axes.set_ylabel(Label.STRAIN)


def draw_driven(
    figure: Any, t: np.ndarray, design: Design, field: np.ndarray, strain: np.ndarray
) -> tuple[Any, Any]:
    """Draw the configuration above the strain that drives it, as Fig. 4a; return both axes.

    Args:
        t: Times in 1000 time units, shape (m,).
        field: Configuration, shape (m, N).
    """
    upper, lower = stacked_axes(figure)[:, 0]
    mesh = draw_contour(upper, t, design.sites - MIDDLE_SITE, field)
    mark_defects(upper, design, MIDDLE_SITE)
    upper.set_ylabel('$x = j - 100$, level')
    phase_bar(figure, mesh, upper, (design.D_s1, design.D_s2))
    draw_schedule(lower, t, strain)
    lower.set(xlim=(t[0], t[-1]), xlabel=Label.TIME)
    return upper, lower


def mark_printed_walls(axes: Any, walls: Sequence[tuple[float, float]]) -> None:
    """Draw the times and places of a wall that the paper prints."""
    t, places = zip(*walls, strict=True)
    axes.plot(
        t, places, 'D', color=Colour.PRINTED, mec='w', ms=8, clip_on=False, zorder=6,
        label=Label.PRINTED,
    )  # fmt: skip


def phase_bar(figure: Any, mesh: Any, axes: Any, states: Sequence[float]) -> None:
    """Add a colour bar whose ticks are the two ground states."""
    bar = figure.colorbar(mesh, ax=axes, ticks=states, shrink=0.7, pad=0.01)
    bar.ax.set_yticklabels(['$\\Delta_{s1}$\ninactive', '$\\Delta_{s2}$\nactive'])
    bar.ax.set_title(r'$\Delta_j$')


def mark_defects(axes: Any, design: Design, origin: float = 0.0) -> None:
    """Draw a line at every defect, and name levels by their codes: at most eight of them."""
    places = [design.defect_site(level) - origin for level in range(design.levels)]
    every = -(-design.levels // 8)
    for place in places:
        axes.axhline(place, color=Colour.INK, lw=0.4, alpha=0.3)
    codes = [f'{place:.0f}   {design.code(m)}' for m, place in enumerate(places)]
    axes.set_yticks(places[::every], codes[::every])
