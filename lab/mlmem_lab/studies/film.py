# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The film of the README: write, read, erase: python3 -m mlmem_lab.studies.film [FOLDER].

Two files, `film.gif` and `film_dark.gif`, of ten seconds each. The pulse of the read is a
hundredth of the step between the phases, and its echo fainter still: the cells are drawn with
small waves magnified while it travels.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg

from mlmem import End, Erase, MemoryElement, Read, Write, load_element
from mlmem.instrument.echo import Echo, detection_threshold
from mlmem.physics import CASE_II

from ..results import CHECKOUT_ROOT, DEVICE_MODULES, keep_picture
from . import style
from .trace import Trace, record_procedure


def record_element(level: int = 3) -> tuple[Trace, dict[str, int], Echo]:
    """Return an element over all ticks, in how many ticks each procedure had ended, and the echo.

    Raises:
        ValueError: A procedure failed.
    """
    element, trace, ended = MemoryElement(load_element('case_2')), Trace(), {}
    for name, command in (('write', Write(level)), ('read', Read()), ('erase', Erase())):
        if not (outcome := record_procedure(element, command, trace)).success:
            raise ValueError(f'{name} failed: {outcome}')
        ended[name] = len(trace.t)
        if name == 'read':
            echo = next(each for each in reversed(trace.echoes) if each.end is End.LEFT)
    return trace, ended, echo


def draw_frames(
    theme: Mapping[str, str], trace: Trace, ended: Mapping[str, int], echo: Echo
) -> Any:
    """Yield the frames of the film, and for how many milliseconds each is shown."""
    ink, faint = theme['text.color'], theme['axes.edgecolor']
    t = 1e-3 * np.array(trace.t)
    field, strain = np.array(trace.configuration), 1e3 * np.array(trace.strain)
    figure = style.new_figure(3.9)
    grid = figure.add_gridspec(3, 2, width_ratios=(1.9, 1.0), height_ratios=(1.0, 2.0, 0.9))
    cells, over, lower = (figure.add_subplot(grid[row, 0]) for row in range(3))
    heard = figure.add_subplot(grid[:, 1])
    defects = [CASE_II.defect_site(level) for level in range(CASE_II.levels)]
    cells.set(xlim=(0.5, CASE_II.N + 0.5), ylim=(-1.7, 1.7), xticks=defects)
    cells.set_yticks([CASE_II.D_s1, CASE_II.D_s2], ['inactive', 'active'])
    cells.set_xticklabels(range(CASE_II.levels))
    over.set(xlim=(0, t[-1]), ylim=(0.5, CASE_II.N + 0.5), xticks=[], ylabel='level')
    over.set_yticks(defects, range(CASE_II.levels))
    lower.axhline(0.0, color=faint, lw=0.8)
    lower.set(xlim=(0, t[-1]), ylim=(1.15 * strain.min(), 1.15 * strain.max()))
    lower.set(xlabel=style.Label.TIME, ylabel=style.Label.STRAIN.replace('strain ', 'strain\n'))
    gain = np.exp(echo.probe.gain_decay * echo.t)
    late = echo.t > 110.0
    v_c = np.where(late, gain * echo.v_c, np.nan)
    limit = float((gain * detection_threshold(echo.probe, echo.t))[0])
    heard.axhline(limit, color=style.Colour.MARK, ls='--', lw=1.2)
    heard.text(
        echo.t[-1], 1.08 * limit, 'threshold', color=style.Colour.MARK, ha='right', fontsize=9
    )
    heard.set(yscale='log', xlim=(0, echo.t[-1]), ylim=(3e-6, 3e-3), xlabel='time units')
    heard.set_title('echo at the left end')

    dots = cells.scatter(CASE_II.sites, field[0], s=9, linewidths=0)
    dots.set_cmap(style.Colour.PHASES)
    dots.set_clim(-1.3, 1.3)
    (pulled,) = lower.plot([], [], color=ink, lw=1.2)
    (wave,) = heard.plot([], [], color=theme['lines.color'])
    (found,) = heard.plot([], [], 'o', color=ink, ms=6)
    delay, level = echo.delay, trace.outcomes[0].level
    assert delay is not None
    assert level is not None
    canvas = FigureCanvasAgg(figure)
    figure.set_dpi(100)
    title = cells.set_title(' ', fontsize=12)
    begun = 0
    read_gain = 40.0  # by how much small waves are magnified during the read
    # how long a frame is shown, and the last of a procedure
    frame_time_ms, last_frame_time_ms = 100, 900
    frames_by_procedure = {'write': 46, 'read': 26, 'erase': 20}  # frames of each procedure
    for name, count in frames_by_procedure.items():
        ticks = np.unique(np.linspace(begun, ended[name] - 1, count).astype(int))
        for number, tick in enumerate(ticks):
            now, share = field[tick], (number + 1) / len(ticks)
            if name == 'read':
                ground = np.where(now > 0.0, CASE_II.D_s2, CASE_II.D_s1)
                calm = np.abs(now - ground) < 0.02  # not the wall itself
                now = np.where(calm, ground + read_gain * (now - ground), now)
                upto = echo.t <= share * echo.t[-1]
                wave.set_data(echo.t[upto], v_c[upto])
                if echo.t[upto][-1] >= delay:
                    found.set_data([delay], [limit])
            echo_delay = delay if len(found.get_xdata()) else None
            title.set_text(_describe_frame(name, level, echo_delay, read_gain))
            dots.set_offsets(np.column_stack((CASE_II.sites, now)))
            dots.set_array(field[tick])
            for old in over.collections:
                old.remove()
            for line in over.lines:
                line.remove()
            style.draw_contour(over, t[: tick + 1 : 3], CASE_II.sites, field[: tick + 1 : 3])
            for place in defects:
                over.axhline(place, color=ink, lw=0.4, alpha=0.3)
            pulled.set_data(t[: tick + 1], strain[: tick + 1])
            canvas.draw()
            yield (
                np.asarray(canvas.buffer_rgba()).copy(),
                last_frame_time_ms if share == 1.0 else frame_time_ms,
            )
        begun = ended[name]


def _describe_frame(name: str, level: int, delay: float | None, gain: float) -> str:
    """Return what happens in a frame; the delay of the echo, if it is already there."""
    if name == 'write':
        return f'write {level}: strain moves the wall to level {level}'
    if name == 'erase':
        return 'erase: strain drives a kink across, which takes the wall out'
    if delay is not None:
        return f'read: an echo after {delay:.0f} time units is level {level}'
    return f'read: a small pulse, drawn {gain:.0f} times larger'


def main(folder: Path) -> None:
    """Make both films."""
    from PIL import Image

    trace, ended, echo = record_element()
    # ground, ink, faint ink and waves on GitHub's pages, light and dark
    themes = {
        'film': ('#ffffff', style.Colour.INK, style.Colour.FAINT, style.Colour.ACTIVE),
        'film_dark': ('#0d1117', '#e6edf3', '#59626e', '#5fb0f2'),
    }
    for name, (ground, ink, faint, wave) in themes.items():
        theme: Any = {
            **dict.fromkeys(('figure.facecolor', 'axes.facecolor'), ground),
            **dict.fromkeys(('text.color', 'axes.labelcolor', 'xtick.color', 'ytick.color'), ink),
            'axes.edgecolor': faint, 'lines.color': wave,
        }  # fmt: skip
        with style.style_context(), mpl.rc_context(theme):
            frames = list(draw_frames(theme, trace, ended, echo))
        images = [Image.fromarray(pixels).convert('RGB') for pixels, _ in frames]
        palette = images[len(images) * 3 // 5].quantize(32, dither=Image.Dither.NONE)
        drawn = [each.quantize(palette=palette, dither=Image.Dither.NONE) for each in images]
        path = folder / f'{name}.gif'
        drawn[0].save(
            path, save_all=True, append_images=drawn[1:], duration=[each for _, each in frames],
            loop=0, optimize=True,
        )  # fmt: skip
        modules = [*DEVICE_MODULES, 'lab/mlmem_lab/studies/film.py']
        keep_picture(path, 'python3 -m mlmem_lab.studies.film', modules)
        print(f'{path}: {path.stat().st_size} bytes')


if __name__ == '__main__':
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else CHECKOUT_ROOT / 'docs' / 'images')
