# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The picture of a session: configuration over time, strain, echoes, delays."""

from __future__ import annotations

import math
from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from mlmem.instrument.echo import detection_threshold
from mlmem.instrument.end import End
from mlmem.physics.values import Array
from mlmem_ros.bag.errors import BagError
from mlmem_ros.bag.reader import BagReader
from mlmem_ros.contract import answers
from mlmem_ros.session.data import SessionData, iterate_timed, load_session
from mlmem_ros.session.records import SessionTopic, name_errors
from mlmem_tools.view.session_frame import Columns

from ..results import keep_picture
from . import style


def draw(bag: str | PathLike[str] | BagReader, path: str | Path, node: str = '') -> Path:
    """Draw the session of a node in a bag, by default its only one, and save it.

    Above, as Fig. 4a, the x-t contour of the configuration over the strain; below, as Figs. 3b
    and 4b, the last echo of every level that was read, or verified after a write, with its
    threshold, and the delays by level.

    The file's suffix selects the format.

    Returns:
        The path.
    """
    reader = bag if isinstance(bag, BagReader) else BagReader(bag)
    session = load_session(reader, node)
    with style.style_context():
        build_figure(session, *read_motion(reader, session)).savefig(path)
    modules = ['lab/mlmem_lab/studies/session_figure.py']
    keep_picture(Path(path), f'mlmem inspect SESSION --plot {path}', modules)
    return Path(path)


def build_figure(session: SessionData, configurations: Columns, displacements: Columns) -> Any:
    """Return the picture of a session and its motion; see `draw` and `read_motion`."""
    end = End.RIGHT if session.header.settings.read.end == End.RIGHT else End.LEFT
    last = {
        int(values['level']): (echo, float(values['delay']))
        for echo, values in find_last_echoes(session, end)
    }
    reads = {level: last[level] for level in sorted(last) if level >= 0}
    max_echo_rows = 8  # most echoes that are shown; of more levels every second, third ..
    chosen = list(reads)[:: -(-len(reads) // max_echo_rows) or 1]
    height = 0.8 + 0.45 * max(3, len(chosen))
    figure = style.new_figure(4.2 + height)
    upper, lower = figure.subfigures(2, 1, height_ratios=(4.2, height))
    _draw_history(upper, session, configurations, displacements)
    left, right = lower.subfigures(1, 2, width_ratios=(1.5, 1.0))
    axes = style.axes_grid(left)[0, 0]
    style.label_panel(
        axes, 'b', f'{"last echoes" if reads else "no echo gave a level"}, {end} end'
    )
    probe = end.select_probe(session.header.settings)
    for row, level in enumerate(chosen):
        (t, _, v_c), delay = reads[level]
        _draw_echo(axes, row, t, v_c / detection_threshold(probe, t), delay)
    axes.set(xlabel='time since the pulse (time units)', ylabel='level')
    axes.set_yticks(range(len(chosen)), [session.header.design.code(level) for level in chosen])
    left.legend(handles=axes.lines[:3], loc='outside lower center', ncols=3)  # of the first row
    delays = {level: delay for level, (_, delay) in reads.items()}
    _draw_delays(style.axes_grid(right)[0, 0], session, delays)
    return figure


def find_last_echoes(session: SessionData, end: End) -> list[tuple[Array, Mapping[str, str]]]:
    """Return the last echo of every successful read at an end, rows t, v_m and v_c of shape
    (3, n), and the values of its outcome; and of every write, which ends with the echo that
    verifies it.
    """
    found, echoes = [], session.events.get('echo', [])
    for time, values in session.outcomes:
        if values.get('procedure') in ('read', 'write') and values.get('end') == end:
            before = [samples for received, samples in echoes if received <= time]
            if before and _has_content_and_delay(values):
                found.append((before[-1].reshape(3, -1).astype(np.float64), values))
    return found


def _has_content_and_delay(values: Mapping[str, str]) -> bool:
    try:
        int(values['level'])
        return 'error' not in values and math.isfinite(float(values['delay']))
    except (KeyError, ValueError):  # words have no delay
        return False


def read_motion(reader: BagReader, session: SessionData) -> tuple[Columns, Columns]:
    """Return the configurations, shape (N,), and the displacements of the substrate's end in
    metres, by their seconds in the session; of a long one every second, fourth ...

    Raises:
        BagError: A message is not what its topic requires.
    """
    configurations, displacements = Columns(), Columns()
    names = ('field', 'joint_states', SessionTopic.HEADER)  # with which the session begins
    for seconds, message in iterate_timed(reader, [f'{session.node}/{name}' for name in names]):
        with name_errors(f'{message.topic} at {seconds:.3f} s'):
            if message.topic.endswith('/field'):
                field = np.asarray(reader.deserialize(message).data, dtype=np.float32)
                if len(field) != (cells := session.header.design.N):
                    raise BagError(f'data must have {cells} cells; got {len(field)}')
                configurations.add(seconds, field)
            elif message.topic.endswith('/joint_states'):
                joints = reader.deserialize(message)
                displacements.add(seconds, answers.parse_displacement(joints))
    return configurations, displacements


def _draw_history(
    figure: Any, session: SessionData, configurations: Columns, displacements: Columns
) -> None:
    design = session.header.design
    upper, lower = style.stacked_axes(figure)[:, 0]
    if configurations.t:
        mesh = style.draw_contour(
            upper, np.array(configurations.t), design.sites, np.array(configurations.rows)
        )
        style.mark_defects(upper, design)
        upper.set_ylabel('site $j$, level')
        style.phase_bar(figure, mesh, upper, (design.D_s1, design.D_s2))
    else:  # of a real element
        upper.set_axis_off()
    what = 'configuration' if configurations.t else 'configuration not recorded'
    style.label_panel(
        upper, 'a', f'{session.node}, {design.levels} levels, {design.N} cells: {what}'
    )
    length = session.header.settings.scale.length * design.end_displacement(1.0)
    strains = np.array(displacements.rows) / length
    style.draw_schedule(lower, np.array(displacements.t), strains)
    lower.set_xlabel('time (s)')


def _draw_echo(axes: Any, row: int, t: Array, ratio: Array, delay: float) -> None:
    """Draw v_c over its threshold, on a logarithmic scale about a row."""
    shown_amplitudes = (0.05, 20.0)  # range of v_c over the threshold that is shown
    decade_height_rows = 0.35  # height of a factor of ten, in rows
    height = row + decade_height_rows * np.log10(np.clip(ratio, *shown_amplitudes))
    axes.axhline(row, color=style.Colour.MARK, ls='--', label='threshold')
    axes.plot(t, height, color=style.Colour.ACTIVE, label='$v_c$, logarithmic')
    axes.fill_between(
        t, row, height, where=height > row, color=style.Colour.ACTIVE, alpha=0.25, lw=0.0
    )
    axes.plot([delay] * 2, [row - 0.4, row + 0.4], color=style.Colour.INK, label='delay')


def _draw_delays(axes: Any, session: SessionData, delays: dict[int, float]) -> None:
    calibrated = session.header.calibration.left.delays
    axes.plot(
        range(len(calibrated)), calibrated, '+', color=style.Colour.INK, ms=10, label='calibrated'
    )
    axes.plot(
        list(delays), list(delays.values()), 'o', color=style.Colour.ACTIVE, ms=5, label='measured'
    )
    axes.set(xlabel='level', ylabel=r'echo delay $\Delta t$ (time units)')
    axes.legend()
    style.label_panel(axes, 'c', 'delay of every level')
