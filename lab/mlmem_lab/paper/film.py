# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What films share: cells that move, a curve that grows with time, and how they become a GIF."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np

from mlmem_ros.physics import Design

from ..studies import style
from .figure import Data

COLOURS = 24
"""Palette of a film: enough for two colour ramps, and small."""

MILLISECONDS = 60
"""Time per frame."""

Show = Callable[[int], Iterable[Any]]
"""Sets what moves to a frame, and returns it; what does not move is drawn once."""


def save_film(figure: Any, show: Show, frames: int, stem: Path) -> list[Path]:
    """Write a film as GIF; return the file."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from PIL import Image

    figure.set_dpi(90)
    canvas = FigureCanvasAgg(figure)
    for artist in show(0):
        artist.set_animated(True)
    canvas.draw()
    still = canvas.copy_from_bbox(figure.bbox)
    pictures = []
    for frame in range(frames):
        canvas.restore_region(still)
        for artist in show(frame):
            artist.axes.draw_artist(artist)
        picture = Image.fromarray(np.asarray(canvas.buffer_rgba())).convert('RGB')
        pictures.append(picture.quantize(COLOURS, dither=Image.Dither.NONE))
    path = stem.with_suffix('.gif')
    pictures[0].save(
        path, save_all=True, append_images=pictures[1:], duration=MILLISECONDS, loop=0,
        optimize=True,
    )  # fmt: skip
    return [path]


def growing(axes: Any, t: np.ndarray, y: np.ndarray) -> Show:
    """Draw a pale curve, shapes (m,), of which a frame shows the past and the present in ink."""
    axes.plot(t, y, color=style.FAINT, lw=1.0)
    (past,) = axes.plot([], [], color=style.INK)
    (now,) = axes.plot([], [], 'o', color=style.INK, ms=5)

    def show(frame: int) -> list[Any]:
        past.set_data(t[: frame + 1], y[: frame + 1])
        now.set_data(t[frame : frame + 1], y[frame : frame + 1])
        return [past, now]

    return show


def cells(axes: Any, design: Design, heights: np.ndarray, field: np.ndarray) -> Show:
    """Draw cells over their sites in the colours of their phases.

    Args:
        axes: Where to draw; lines and codes at the defects are added.
        design: The element.
        heights: Where the cells are in every frame, shape (m, N).
        field: Their configuration, shape (m, N).
    """
    for level in range(design.levels):
        axes.axvline(design.defect(level), color=style.FAINT, lw=0.8, zorder=0)
    ticks = [design.defect(level) for level in range(design.levels)]
    axes.set_xticks(ticks, [f'{site}\n{design.code(m)}' for m, site in enumerate(ticks)])
    dots = axes.scatter(
        design.sites, heights[0], c=field[0], cmap=style.PHASES, vmin=-1.3, vmax=1.3, s=12,
        linewidths=0,
    )  # fmt: skip

    def show(frame: int) -> list[Any]:
        dots.set_offsets(np.column_stack((design.sites, heights[frame])))
        dots.set_array(field[frame])
        return [dots]

    return show


def save_walls(data: Data, design: Design, stem: Path) -> list[Path]:
    """Write a film of cells that change their phases over the strain that makes them.

    Args:
        data: `t`, `strain` and `caption`, shape (m,), and `field`, shape (m, N).
        design: The element.
        stem: Of the file.
    """
    figure = style.new_figure(3.6)
    upper, lower = style.axes_grid(figure, 2, 1, height_ratios=(2.4, 1.0))[:, 0]
    dots = cells(upper, design, data['field'], data['field'])
    upper.set(ylim=(-1.5, 1.5), xlabel='cell $j$, level')
    upper.set_yticks([design.D_s1, design.D_s2], ['inactive', 'active'])
    title = upper.set_title(' ')
    curve = growing(lower, data['t'] / 1e3, 1e3 * data['strain'])
    lower.set(xlabel=style.TIME, ylabel=style.STRAIN)

    def show(frame: int) -> list[Any]:
        title.set_text(str(data['caption'][frame]))
        return [title, *dots(frame), *curve(frame)]

    return save_film(figure, show, len(data['t']), stem)
