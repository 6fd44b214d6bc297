# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Ours: the energy of a write, where it becomes heat, and other memories beside it."""

from __future__ import annotations

from typing import Any

import numpy as np

from mlmem import Command, Erase, Read, Write, new_element, preset
from mlmem.moves.planner import disable_kicks
from mlmem.physics import CASE_II, find_level

from ...studies import style
from ...studies.trace import Trace, record_procedure
from ..figure import Data, Figure, Quality
from ..meter import fit_meter

FIGURE = Figure(
    'energy',
    'The energy of a write, and where it becomes heat',
    seconds=30,
)

COUNTED_COMMANDS = (
    'start: level 0 from blank, read', 'seven steps, read', 'read', 'erase from level 7',
)  # fmt: skip
"""The commands whose energy is counted, as the pages call them."""


@FIGURE.data
def compute_data(quality: Quality) -> Data:
    """Keep the books of a write of level 0 from blank, of the steps up, a read and an erase.

    Returns:
        The arrays `summarise_books` (command x actuator work, transducer work, heat, energy
        stored), `levels`, `ok` and `time` of every command, `heat` of every cell (command x N),
        the number of `steps`, and `lent`: the energy in the substrate at the two peaks.
    """
    settings = disable_kicks(preset('case_2').settings)
    last = quality.pick(1, CASE_II.levels - 1)
    element = new_element(CASE_II, settings)
    meter = fit_meter(element)
    commands: list[Command] = [Write(0), Write(last), Read(), Erase()]
    books, times, seen, success, heat = [], [], [], [], []
    for command in quality.pick(commands[:3], commands):
        before, start, warm = meter.books(), element.ticks, meter.heat.copy()
        outcome = record_procedure(element, command, Trace())
        books.append(meter.books() - before)
        times.append((element.ticks - start) * element.tick)
        heat.append(meter.heat - warm)
        seen.append(find_level(CASE_II, element.chain.configuration))
        success.append(outcome.success)
    stiffness = 1.0 / np.sum(1.0 / CASE_II.s)
    peaks = np.array([settings.write.compression, settings.write.tension])
    return {
        'books': books,
        'time': times,
        'levels': seen,
        'ok': success,
        'heat': heat,
        'steps': last,
        'lent': 0.5 * stiffness * (peaks * CASE_II.N) ** 2,
    }


@FIGURE.result
def summarise_books(data: Data) -> dict[str, Any]:
    """Return what every command took, one level of a write, and a bit."""
    columns = ('actuator', 'transducer', 'heat', 'stored')
    commands = {
        command: {'time': float(at), **dict(zip(columns, map(float, row), strict=True))}
        for command, at, row in zip(COUNTED_COMMANDS, data['time'], data['books'], strict=False)
    }
    start, steps, read = (book['heat'] for book in [*commands.values()][:3])
    return {
        'commands': commands,
        'level': (steps - read) / int(data['steps']),
        'bit': (start + 0.5 * steps + read) / 3.0,
        'lent': [float(each) for each in data['lent']],
    }


@FIGURE.register_drawing
def draw_figure(data: Data) -> Any:
    """Draw the books, and where the heat is made."""
    figure = style.new_figure(3.8)
    books, cells = style.axes_grid(figure, 1, 2, width_ratios=(1.0, 1.2))[0]
    table, steps = data['books'].copy(), data['steps']
    table[1] = (table[1] - table[2]) / steps
    x = np.arange(len(table))
    books.bar(x, table[:, 2], 0.6, color=style.FAINT_COLOUR, label='heat')
    for column, tint, text in (
        (0, style.COMPRESSION_COLOUR, 'actuator'),
        (1, style.MARK_COLOUR, 'transducer'),
    ):
        label = f'work of the {text}'
        books.plot(x, table[:, column], '_', color=tint, ms=12, mew=3.0, label=label)
    heat = data['heat']
    cells.step(
        CASE_II.sites, 1e3 * (heat[1] - heat[2]) / steps, where='mid', color=style.ACTIVE_COLOUR
    )
    books.set_xticks(range(len(table)), ['start', 'step', 'read', 'erase 7'][: len(table)])
    books.set(yscale='log', ylim=(1e-4, 3e3), ylabel=r'energy ($k_r a^2$)')
    books.legend(loc='upper left')
    style.label_panel(books, 'a', 'what a command costs')
    for level in range(CASE_II.levels):
        cells.axvline(
            CASE_II.defect_site(level), color=style.FAINT_COLOUR, lw=0.8, ls=':', zorder=0
        )
    cells.set(xlabel='cell $j$', ylabel=r'heat of a step ($10^{-3}\,k_r a^2$)', ylim=(0.0, None))
    style.label_panel(cells, 'b', 'where a step becomes heat')
    return figure
