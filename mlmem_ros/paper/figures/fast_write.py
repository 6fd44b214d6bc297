# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Ours: how fast a write can be, and how far its peaks may be off."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
from matplotlib.colors import ListedColormap
from numpy.typing import NDArray

from ...analysis.bare import departures, scaled
from ...device.motion import Cycle
from ...device.settings import WriteSettings, peak
from ...parameter_file import load
from ...physics import Chain, Design, Specimen
from ...physics.equilibrium import resting_wall
from ...physics.potential import Array
from ...studies import style
from ...studies.trace import strain_chain, wall_path
from ..figure import Data, Figure, Quality

FIGURE = Figure(
    'fast',
    'How fast a write can be, and how far its peaks may be off',
    caption='(a) One write of levels 0 to 7, slow and fast. (b-k) How far both peaks may be '
    'off: in the blue area every write upward ends at its level. Cross: the operating '
    'point. Dotted: the distance to the nearest failure. Number: time units per level.',
    seconds=700,
)

PLAIN = 'bits_3'
"""The paper's element with its slow ramps: what the others are compared with."""

SHIPPED = (
    'fast', 'bits_1', 'bits_2', 'damped_bits_3', 'bits_4', 'damped_bits_4', 'bits_5', 'bits_6',
    'bits_8',
)  # fmt: skip
"""The configurations that write fast."""

COLUMNS = 5
"""Maps side by side."""

STEPS = 128
"""Steps that a point of a map may take, if the rows from both ends' levels take no more."""


def starts(design: Design) -> list[int]:
    """Return the levels that writes are started from: all up to sixteen, else some of either end.

    The row from level k and that from the k-th last one are as many steps together as there are
    levels: as many pairs as fit into `STEPS` are taken, and one at least.
    """
    steps = range(design.levels - 1)
    pairs = max(1, STEPS // design.levels)
    return sorted({*steps[:pairs], *steps[-pairs:]})


def factors_of(design: Design, factors: Array) -> Array:
    """Return the factors on the peaks that are tried: of the largest elements every second."""
    return factors[::2] if design.levels > STEPS else factors


def writes(
    design: Design, write: WriteSettings, starts: Iterable[int] | None = None
) -> Iterator[bool]:
    """Yield for every write upward whether it succeeds; see `departures`.

    Args:
        design: The element.
        write: Its cycles. The rate of an actuator does not limit them here.
        starts: The levels that are started from, a wall at rest at each; all by default.
    """
    last = design.levels - 1
    for start in range(last) if starts is None else starts:
        yield from (away < 1.0 for away in departures(design, write, start, last))


def passes(
    design: Design, write: WriteSettings, factors: Array, starts: Iterable[int] | None = None
) -> Array:
    """Return where all writes upward succeed, over factors on both peaks.

    Args:
        design: The element.
        write: The operating point.
        factors: On either peak, shape (m,).
        starts: As for `writes`, which may be passed through more than once.

    Returns:
        By compression and tension, booleans of shape (m, m).
    """
    return np.array(
        [
            [all(writes(design, scaled(write, first, second), starts)) for second in factors]
            for first in factors
        ]
    )


def distance(factors: Array, passed: NDArray[np.bool_]) -> float:
    """Return how far the operating point is from the nearest failure of a map.

    The measure is that of `mlmem margins`: the root of the sum of the squares of both relative
    changes; infinite where nothing fails.

    Args:
        factors: On either peak, shape (m,).
        passed: By compression and tension, shape (m, m).
    """
    far = np.hypot(factors[:, None] - 1.0, factors[None, :] - 1.0)
    return float(np.min(far[~passed], initial=np.inf))


@FIGURE.data
def compute(quality: Quality) -> Data:
    """Map which peaks write every level from every lower one, and follow two writes.

    Returns:
        The names of the `maps`, the plain schedule's first; per name the factors on the peaks,
        shape (m,), `NAME_factors`, whether all writes upward succeed (compression x tension,
        m x m), `NAME_passed`, and the time per level, `NAME_time`; and the wall's path of a plain
        and a fast write of the paper's levels 0 to 7.
    """
    factors = np.array(quality.pick([0.3, 1.0], np.round(np.arange(0.4, 1.65, 0.1), 1)))
    names = quality.pick((PLAIN, 'fast', 'bits_2'), (PLAIN, *SHIPPED))
    data: Data = {'maps': np.array(names)}
    for name in names:
        design, settings = load(name)
        data[f'{name}_factors'] = tried = factors_of(design, factors)
        first = quality.pick([0], starts(design))
        data[f'{name}_passed'] = passes(design, settings.write, tried, first)
        data[f'{name}_time'] = np.array(Cycle.planned(settings.write, 1.0).duration)
    for kind, name in (('plain', PLAIN), ('fast', 'fast')):
        design, settings = load(name)
        path = _path(design, settings.write, quality.pick(1, design.levels - 1))
        data |= {f'{kind}_{key}': value for key, value in path.items()}
    return data


def _path(design: Design, write: WriteSettings, last: int) -> Data:
    """Return time, strain and wall of one write from level 0 up."""
    cycle = Cycle(())
    for level in range(last):
        cycle += Cycle.planned(write, peak(write, design.freed_by_compression(level)))
    chain = Chain(design)
    chain.place(resting_wall(Specimen(design), 0))
    trace = strain_chain(chain, cycle, 20.0)
    wall = wall_path(design, trace.configuration)
    return {'t': np.array(trace.t), 'strain': np.array(trace.strain), 'wall': wall}


@FIGURE.drawing
def draw(data: Data) -> Any:
    """Draw two writes over each other, and the maps."""
    figure = style.new_figure(7.4)
    upper, lower = figure.subfigures(2, 1, height_ratios=(1.0, 1.5))
    wall, strain = style.stacked(upper)[:, 0]
    for name, color in (('plain', style.FAINT), ('fast', style.S2)):
        t = data[f'{name}_t'] / 1e3
        wall.plot(t, data[f'{name}_wall'], color=color, label=name)
        strain.plot(t, 1e3 * data[f'{name}_strain'], color=color)
    wall.set(ylabel='wall $X$ (cells)')
    wall.legend(loc='lower right')
    style.label(wall, 'a', "levels 0 to 7 of the paper's element")
    strain.set(ylabel=style.STRAIN, xlabel=style.TIME)
    rows = -(-len(data['maps']) // COLUMNS)
    panels = style.axes_grid(lower, rows, COLUMNS, sharex=True, sharey=True)
    for axes in panels.ravel()[len(data['maps']) :]:
        axes.set_visible(False)
    colors = ListedColormap([style.PALE, style.S2])
    for axes, name, letter in zip(panels.ravel(), data['maps'], 'bcdefghijk', strict=False):
        factors, passed = data[f'{name}_factors'], data[f'{name}_passed']
        style.window(axes, factors, passed, distance(factors, passed), colors)
        style.label(axes, letter, f'{data[f"{name}_time"]:g}\n{name}')
    lower.supxlabel('tension, over its own', fontsize='medium')
    lower.supylabel('compression, over its own', fontsize='medium')
    return figure
