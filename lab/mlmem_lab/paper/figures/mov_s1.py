# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Mov. S1: the walls moving under strain: write level 0 to 7, then erase."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mlmem import Command, Erase, MemoryElement, Write
from mlmem.physics import CASE_II

from ...studies import style
from ...studies.trace import Trace, record_procedure
from ..figure import Data, Figure, Quality

FIGURE = Figure(
    's1',
    'Mov. S1: the walls moving under strain',
    seconds=13,
)

PALETTE_COLOURS = 24
"""Palette of the film: enough for a colour ramp, and small."""

FRAME_TIME_MS = 60
"""Time per frame."""


@FIGURE.register_data
def compute_data(quality: Quality) -> Data:
    """Return frames of configuration and strain while every level is written and erased."""
    design, element, trace = CASE_II, MemoryElement(CASE_II), Trace()
    captions: list[str] = []
    levels = range(quality.pick(2, design.levels))
    commands: dict[str, Command] = {
        f'write level {m}  ({design.code(m)})': Write(m) for m in levels
    }
    commands['erase: a kink meets the wall'] = Erase()
    for text, command in commands.items():
        record_procedure(element, command, trace)
        captions += [text] * (len(trace.t) - len(captions))
    frames = np.linspace(0, len(trace.t) - 1, quality.pick(8, 200)).astype(int)
    return {
        't': np.array(trace.t)[frames],
        'strain': np.array(trace.strain)[frames],
        'field': np.array(trace.configuration, dtype=np.float32)[frames],
        'caption': np.array(captions)[frames],
        'success': [outcome.success for outcome in trace.outcomes],
    }


@FIGURE.register_film
def save_movie(data: Data, stem: Path) -> list[Path]:
    """Write a film of the cells, which change their phases, over the strain; return the file.

    What does not move is drawn once.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from PIL import Image

    t, field, strain = 1e-3 * data['t'], data['field'], 1e3 * data['strain']
    figure = style.new_figure(3.6)
    upper, lower = style.axes_grid(figure, 2, 1, height_ratios=(2.4, 1.0))[:, 0]
    places = [CASE_II.defect_site(level) for level in range(CASE_II.levels)]
    for place in places:
        upper.axvline(place, color=style.FAINT_COLOUR, lw=0.8, zorder=0)
    names = [f'{place}\n{CASE_II.code(level)}' for level, place in enumerate(places)]
    upper.set_xticks(places, names)
    upper.set_yticks([CASE_II.D_s1, CASE_II.D_s2], ['inactive', 'active'])
    upper.set(ylim=(-1.5, 1.5), xlabel='cell $j$, level')
    lower.plot(t, strain, color=style.FAINT_COLOUR, lw=1.0)
    lower.set(xlabel=style.TIME_LABEL, ylabel=style.STRAIN_LABEL)

    title = upper.set_title(' ')
    cells = upper.scatter(
        CASE_II.sites, field[0], c=field[0], cmap=style.PHASE_COLOURS, vmin=-1.3, vmax=1.3, s=12,
        linewidths=0,
    )  # fmt: skip
    (past,) = lower.plot([], [], color=style.INK_COLOUR)
    (now,) = lower.plot([], [], 'o', color=style.INK_COLOUR, ms=5)
    moving = title, cells, past, now

    figure.set_dpi(90)
    canvas = FigureCanvasAgg(figure)
    for artist in moving:
        artist.set_animated(True)
    canvas.draw()
    still = canvas.copy_from_bbox(figure.bbox)
    pictures = []
    for frame in range(len(t)):
        title.set_text(str(data['caption'][frame]))
        cells.set_offsets(np.column_stack((CASE_II.sites, field[frame])))
        cells.set_array(field[frame])
        past.set_data(t[: frame + 1], strain[: frame + 1])
        now.set_data(t[frame : frame + 1], strain[frame : frame + 1])
        canvas.restore_region(still)
        for artist in moving:
            artist.axes.draw_artist(artist)
        picture = Image.fromarray(np.asarray(canvas.buffer_rgba())).convert('RGB')
        pictures.append(picture.quantize(PALETTE_COLOURS, dither=Image.Dither.NONE))
    path = stem.with_suffix('.gif')
    pictures[0].save(
        path, save_all=True, append_images=pictures[1:], duration=FRAME_TIME_MS, loop=0,
        optimize=True,
    )  # fmt: skip
    return [path]
