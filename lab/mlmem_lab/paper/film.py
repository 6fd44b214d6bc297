# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A film of the cells of an element, which change their phases, over a signal that moves them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mlmem.physics import Design
from mlmem.physics.values import Array

from ..studies import style
from .figure import Data


def save_film(design: Design, data: Data, signal: Array, label: str, stem: Path) -> list[Path]:
    """Write a GIF of a stem; return the file. What does not move is drawn once.

    Args:
        data: With `t` in time units, shape (m,), `field`, shape (m, N), and `caption`, shape (m,).
        signal: What is drawn below the cells, shape (m,), and what its axis is called.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from PIL import Image

    t, field = 1e-3 * data['t'], data['field']
    figure = style.new_figure(3.6)
    upper, lower = style.axes_grid(figure, 2, 1, height_ratios=(2.4, 1.0))[:, 0]
    places = [design.defect_site(level) for level in range(design.levels)]
    for place in places:
        upper.axvline(place, color=style.Colour.FAINT, lw=0.8, zorder=0)
    names = [f'{place}\n{design.code(level)}' for level, place in enumerate(places)]
    upper.set_xticks(places, names)
    upper.set_yticks([design.D_s1, design.D_s2], ['inactive', 'active'])
    upper.set(ylim=(-1.5, 1.5), xlabel='cell $j$, level')
    lower.plot(t, signal, color=style.Colour.FAINT, lw=1.0)
    lower.set(xlabel=style.Label.TIME, ylabel=label)

    title = upper.set_title(' ')
    cells = upper.scatter(
        design.sites, field[0], c=field[0], cmap=style.Colour.PHASES, vmin=-1.3, vmax=1.3, s=12,
        linewidths=0,
    )  # fmt: skip
    (past,) = lower.plot([], [], color=style.Colour.INK)
    (now,) = lower.plot([], [], 'o', color=style.Colour.INK, ms=5)
    moving = title, cells, past, now

    # one palette for all frames: the ramp of the phases, and greys
    colours = np.vstack(
        [
            style.Colour.PHASES(np.linspace(0.0, 1.0, 16))[:, :3],
            np.linspace(0.0, 1.0, 8)[:, None] + np.zeros(3),
        ]
    )
    palette = Image.new('P', (1, 1))
    palette.putpalette(np.rint(255.0 * colours).astype(np.uint8).tobytes())

    figure.set_dpi(80)
    canvas = FigureCanvasAgg(figure)
    for artist in moving:
        artist.set_animated(True)
    canvas.draw()
    still = canvas.copy_from_bbox(figure.bbox)
    pictures = []
    for frame in range(len(t)):
        title.set_text(str(data['caption'][frame]))
        cells.set_offsets(np.column_stack((design.sites, field[frame])))
        cells.set_array(field[frame])
        past.set_data(t[: frame + 1], signal[: frame + 1])
        now.set_data(t[frame : frame + 1], signal[frame : frame + 1])
        canvas.restore_region(still)
        for artist in moving:
            artist.axes.draw_artist(artist)
        picture = Image.fromarray(np.asarray(canvas.buffer_rgba())).convert('RGB')
        pictures.append(picture.quantize(palette=palette, dither=Image.Dither.NONE))
    path = stem.with_suffix('.gif')
    # the duration of a frame is in ms
    pictures[0].save(
        path, save_all=True, append_images=pictures[1:], duration=90, loop=0,
        optimize=True,
    )  # fmt: skip
    return [path]
