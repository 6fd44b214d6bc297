# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Ours: the energy of a write, where it becomes heat, and other memories beside it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ...device import Command, Erase, Read, Settings, Write, new_element
from ...device.moves import paper_way
from ...parameter_file import load
from ...physics import CASE_II, level_of
from ...studies.style import COMPRESSION, FAINT, INK, MARK, S1, S2, axes_grid, label, new_figure
from ...studies.trace import Trace, watch
from ..figure import Data, Figure, Quality
from ..meter import fit_meter

FIGURE = Figure(
    'energy',
    'The energy of a write, and where it becomes heat',
    caption='Heat of a write, marks: work put in. energy.md tells more.',
    seconds=30,
)

SCHEDULES = {'plain': 'case_2', 'fast': 'fast'}
"""Shipped configurations of the paper's element."""

LANDAUER = 1.380649e-23 * 300.0 * math.log(2.0)
"""k_B T ln 2 at 300 K, in J."""

CELL = 0.01
"""Lattice constant of the realisations below, in m: an assumption."""

STIFFNESSES = (1.0, 1000.0)
"""Coupling springs k_r of two realisations, in N/m: an assumption."""

OTHERS = {
    'racetrack, shift': 0.0195e-9 / 32,
    'racetrack, write': 0.108981e-9 / 32,
    'flash, cell (at least)': 0.01e-12,
    'flash, chip (estimate)': 3.3 * 25e-3 * 200e-6 / (2048 * 8),
}
"""Energies of other memories in J per bit; see docs/energy.md for where they are from."""


@FIGURE.data
def compute(quality: Quality) -> Data:
    """Keep the books of a write of level 0 from blank, of the steps up, a read and an erase.

    Returns:
        Per schedule (plain, fast) the arrays `books` (command x actuator work, transducer work,
        heat, energy stored), `levels` and `ok` of every command, `time` of it, `heat` of the
        steps (N,), and `lent`: the energy in the substrate at the two peaks.
    """
    data: Data = {'commands': np.array(['start', 'steps', 'read', 'erase'])}
    data['schedules'] = np.array(list(SCHEDULES))
    last = quality.pick(1, CASE_II.levels - 1)
    for name, source in SCHEDULES.items():
        settings = paper_way(load(source)[1])
        data |= {f'{name}_{key}': value for key, value in _keep(settings, last, quality).items()}
    return data


def _keep(settings: Settings, last: int, quality: Quality) -> Data:
    element = new_element(CASE_II, settings)
    meter = fit_meter(element)
    commands: list[Command] = [Write(0), Write(last), Read(), Erase()]
    books, times, seen, success, heat = [], [], [], [], []
    for command in quality.pick(commands[:3], commands):
        before, start, warm = meter.books(), element.ticks, meter.heat.copy()
        outcome = watch(element, command, Trace())
        books.append(meter.books() - before)
        times.append((element.ticks - start) * element.tick)
        heat.append(meter.heat - warm)
        seen.append(level_of(CASE_II, element.chain.configuration))
        success.append(outcome.success)
    stiffness = 1.0 / np.sum(1.0 / CASE_II.s)
    peaks = np.array([settings.write.compression, settings.write.tension])
    return {
        'books': np.array(books),
        'time': np.array(times),
        'levels': np.array(seen),
        'ok': np.array(success),
        'heat': np.array(heat),
        'steps': np.array(last),
        'lent': 0.5 * stiffness * (peaks * CASE_II.N) ** 2,
    }


def per_bit(data: Data, name: str) -> float:
    """Return the work of writing and verifying a level, all equally likely, over its bits."""
    books, steps = data[f'{name}_books'], 0.5 * (CASE_II.levels - 1)
    work = books[:, :2].sum(axis=1)
    read = work[2]
    return float((work[0] + steps * (work[1] - read) / data[f'{name}_steps']) / CASE_II.bits)


@FIGURE.drawing
def draw(data: Data) -> Any:
    """Draw the books, where the heat is made, and other memories beside it."""
    figure = new_figure(7.2, 5.0)
    upper, lower = figure.subfigures(2, 1)
    books, cells = axes_grid(upper, 1, 2, width_ratios=(1.0, 1.5))[0]
    colors = {'plain': FAINT, 'fast': S2}
    for shift, name in zip((-0.2, 0.2), data['schedules'], strict=True):
        table = data[f'{name}_books'].copy()
        table[1] = (table[1] - table[2]) / data[f'{name}_steps']
        x = np.arange(len(table)) + shift
        books.bar(x, table[:, 2], 0.36, color=colors[str(name)], label=f'{name}: heat')
        books.plot(x, table[:, 0], '_', color=COMPRESSION, ms=9, mew=1.5)
        books.plot(x, table[:, 1], '_', color=MARK, ms=9, mew=1.5)
        heat = data[f'{name}_heat']
        step = (heat[1] - heat[2]) / data[f'{name}_steps']
        cells.step(CASE_II.sites, 1e3 * step, where='mid', color=colors[str(name)], lw=0.9,
                   label=str(name))  # fmt: skip
    books.plot([], [], '_', color=COMPRESSION, mew=1.5, label='work of the actuator')
    books.plot([], [], '_', color=MARK, mew=1.5, label='work of the transducer')
    names = ['start', 'one step', 'read', 'erase from 7']
    books.set_xticks(range(len(table)), names[: len(table)])
    books.set(yscale='log', ylim=(1e-4, 30.0), ylabel=r'energy ($k_r a^2$)')
    books.legend(fontsize=6, loc='upper center', ncols=2)
    label(books, 'a', 'the books')
    for level in range(CASE_II.levels):
        cells.axvline(CASE_II.defect(level), color=INK, lw=0.3, alpha=0.3, zorder=0)
    cells.set(xlabel='cell j', ylabel=r'heat of a step ($10^{-3}\,k_r a^2$)', ylim=(0.0, None))
    cells.legend()
    label(cells, 'b', 'where a step becomes heat (lines: defects)')
    _compare(axes_grid(lower)[0, 0], data)
    return figure


def _compare(axes: Any, data: Data) -> None:
    """Draw energies per bit in joules on one line each."""
    bars = {r'$k_BT\ln2$, 300 K': (LANDAUER, INK)}
    bars |= {name: (value, S1) for name, value in OTHERS.items()}
    for stiffness in STIFFNESSES:
        for name in data['schedules']:
            text = f'this element, {name}, $k_r$ = {stiffness:g} N/m'
            bars[text] = (per_bit(data, str(name)) * stiffness * CELL**2, S2)
    for row, (value, color) in enumerate(bars.values()):
        axes.barh(row, value, color=color, height=0.6)
        axes.text(1.6 * value, row, f'{value:.1e} J', va='center', fontsize=6.5)
    axes.set_yticks(range(len(bars)), list(bars))
    axes.invert_yaxis()
    axes.set(xscale='log', xlim=(1e-22, 1e3), xlabel='energy per bit written (J)')
    label(axes, 'c', f'beside other memories (lattice constant {100 * CELL:g} cm)')
