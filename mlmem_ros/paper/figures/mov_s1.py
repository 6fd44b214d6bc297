# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Mov. S1: the walls moving under strain: write level 0 to 7, then erase."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ...device import Erase, Write, new_element
from ...physics import CASE_II
from ...studies.style import FAINT, INK, PHASES, axes_grid, new_figure
from ...studies.trace import Trace, watch
from ..figure import Data, Figure, Quality

FIGURE = Figure(
    's1',
    'Mov. S1: the walls moving under strain',
    caption='Every level written, then erased.',
    seconds=13,
)

COLOURS = 48
"""Palette of the film: enough for two colour ramps, and small."""

MILLISECONDS = 60
"""Time per frame."""


@FIGURE.data
def compute(quality: Quality) -> Data:
    """Return frames of configuration and strain while every level is written and erased."""
    design, element, trace = CASE_II, new_element(CASE_II), Trace()
    captions: list[str] = []
    last = quality.pick(1, design.levels - 1)
    for level in range(last + 1):
        watch(element, Write(level), trace)
        captions += [f'write level {level}  ({design.code(level)})'] * (
            len(trace.t) - len(captions)
        )
    watch(element, Erase(), trace)
    captions += ['erase: a kink meets the wall'] * (len(trace.t) - len(captions))
    frames = np.linspace(0, len(trace.t) - 1, quality.pick(24, 320)).astype(int)
    return {
        't': np.array(trace.t)[frames],
        'strain': np.array(trace.strain)[frames],
        'field': np.array(trace.configuration, dtype=np.float32)[frames],
        'caption': np.array(captions)[frames],
        'success': np.array([outcome.success for outcome in trace.outcomes]),
    }


class _Film:
    """The figure of the film, whose moving parts are replaced from frame to frame."""

    def __init__(self, data: Data) -> None:
        self.figure = new_figure(6.4, 3.0)
        self._data = data
        upper, lower = axes_grid(self.figure, 2, 1, height_ratios=(2.4, 1.0))[:, 0]
        x = CASE_II.sites - 100.0
        for level in range(CASE_II.levels):
            place = CASE_II.defect(level) - 100.0
            upper.axvline(place, color=FAINT, lw=0.6, zorder=0)
            upper.annotate(CASE_II.code(level), (place, 1.42), ha='center', fontsize=6.5)
        self._cells = upper.scatter(x, x, c=x, cmap=PHASES, vmin=-1.5, vmax=1.5, s=7, linewidths=0)
        upper.set(ylim=(-1.4, 1.4), xlim=(-100, 126), xlabel='$x = j - 100$ (lines: defects)')
        upper.set_yticks([CASE_II.D_s1, CASE_II.D_s2], [r'$\Delta_{s1}$', r'$\Delta_{s2}$'])
        self._title = upper.set_title(' ', pad=12)
        self._upper, self._lower = upper, lower
        self._t, self._strain = data['t'] / 1e3, 1e3 * data['strain']
        lower.plot(self._t, self._strain, color=FAINT, lw=0.8)
        (self._past,) = lower.plot([], [], color=INK, lw=1.0)
        (self._now,) = lower.plot([], [], 'o', color=INK, ms=3)
        lower.set(xlabel=r'time $t\times10^{-3}$', ylabel=r'strain $\varepsilon\times10^3$')

    def show(self, frame: int) -> None:
        """Set the moving parts."""
        field = self._data['field'][frame]
        self._cells.set_offsets(np.column_stack((CASE_II.sites - 100.0, field)))
        self._cells.set_array(field)
        self._title.set_text(str(self._data['caption'][frame]))
        self._past.set_data(self._t[: frame + 1], self._strain[: frame + 1])
        self._now.set_data(self._t[frame : frame + 1], self._strain[frame : frame + 1])

    def moving(self) -> list[tuple[Any, Any]]:
        """Return the moving parts, each with its axes."""
        return [
            (self._upper, self._title), (self._upper, self._cells), (self._lower, self._past),
            (self._lower, self._now),
        ]  # fmt: skip


@FIGURE.film
def save(data: Data, stem: Path) -> list[Path]:
    """Write the film as GIF; return the files."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from PIL import Image

    film = _Film(data)
    film.figure.set_dpi(100)
    canvas = FigureCanvasAgg(film.figure)
    for _, artist in film.moving():
        artist.set_animated(True)
    canvas.draw()
    still = canvas.copy_from_bbox(film.figure.bbox)  # what does not move is drawn once
    pictures = []
    for frame in range(len(data['t'])):
        canvas.restore_region(still)
        film.show(frame)
        for axes, artist in film.moving():
            axes.draw_artist(artist)
        picture = Image.fromarray(np.asarray(canvas.buffer_rgba())).convert('RGB')
        pictures.append(picture.quantize(COLOURS, dither=Image.Dither.NONE))
    path = stem.with_suffix('.gif')
    pictures[0].save(
        path, save_all=True, append_images=pictures[1:], duration=MILLISECONDS, loop=0,
        optimize=True,
    )  # fmt: skip
    return [path]
