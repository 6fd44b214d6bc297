# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Ours: how fast a write can be, and how far its peaks may be off."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from matplotlib.colors import ListedColormap

from ...device.fast import FAST
from ...device.settings import CycleSettings, WriteSettings
from ...physics import CASE_II, Chain, Design, StateError
from ...physics.equilibrium import resting_wall
from ..study import Data, Quality
from ..style import FAINT, INK, MARK, S2, axes_grid, label, new_figure
from ..trace import Segment, level_of, strain_chain, wall_path

DENSE = dataclasses.replace(CASE_II, N=90, J=10, J_s=20, j_0=6.8)
"""Eight levels on cells of ten instead of twenty-five: the wall has less far to go."""

DENSE_WRITE = WriteSettings(
    ramp=80.0, hold=80.0, ease=320.0, ease_to=0.2, release=120.0, settle=0.0,
    final_settle=1000.0, compression=-0.019, tension=0.0143,
)  # fmt: skip
"""600 time units per level, one cycle right after the other."""

HASTY_WRITE = WriteSettings(
    ramp=60.0, hold=115.0, ease=195.0, ease_to=0.47, release=80.0, settle=0.0,
    final_settle=1000.0, compression=-0.026, tension=0.0146,
)  # fmt: skip
"""450: the best that a search found, and no place to work at."""

MAPS = {
    'paper': (CASE_II, FAST.write),
    'dense': (DENSE, DENSE_WRITE),
    'hasty': (DENSE, HASTY_WRITE),
}

STEP = 0.5
"""Time step of the maps; the wall's own motion is a hundred times slower."""


def pulse(peak: float, times: CycleSettings) -> list[Segment]:
    """Return the segments of one cycle, without the last rest of a write."""
    eased = [(times.ease_to * peak, times.ease)] if times.ease else []
    back = [*eased, (0.0, times.release), (0.0, times.settle)]
    return [(peak, times.ramp), (peak, times.hold), *back]


def duration(times: CycleSettings) -> float:
    """Return the time units that one level takes."""
    return sum(time for _, time in pulse(1.0, times))


def failures(design: Design, write: WriteSettings, starts: list[int] | None = None) -> int:
    """Return how many of the writes upward fail: from every start level to every higher one.

    The cycles follow each other as in a write of the device, which rests `final_settle` longer
    after the last; the true wall is looked at.
    """
    chain, found = Chain(design, STEP), 0
    last = design.levels - 1
    for start in range(last) if starts is None else starts:
        chain.place(resting_wall(design, start))
        for level in range(start, last):
            compress = design.freed_by_compression(level)
            try:
                _strain(chain, pulse(write.compression if compress else write.tension, write))
                state = chain.state()
                _strain(chain, [(0.0, write.final_settle)])
                found += level_of(design, chain.configuration) != level + 1
            except StateError:  # driven so hard that the chain is lost
                found += last - level
                break
            chain.restore(state, V_N=0.0, steps_done=0)
    return found


def _strain(chain: Chain, segments: list[Segment]) -> None:
    strain_chain(chain, [segment for segment in segments if segment[1] > 0.0], 1e9)


def compute(quality: Quality) -> Data:
    """Map which peaks write every level from every lower one, and follow two writes.

    Returns:
        Per map (paper, dense, hasty): `compression` and `tension` of its points, `failed`
        (compression x tension) writes of 28, the operating point and the time per level; and
        the wall's path of a plain and a fast write of levels 0 to 7.
    """
    gains = np.array(quality.pick([0.3, 1.0], [0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.3, 1.4, 1.5]))
    starts = quality.pick([5], None)
    data: Data = {'maps': np.array(list(MAPS))}
    for name, (design, write) in MAPS.items():
        failed = [
            [
                failures(design, dataclasses.replace(write, compression=c, tension=t), starts)
                for t in gains * write.tension
            ]
            for c in gains * write.compression
        ]
        data[f'{name}_compression'] = gains * write.compression
        data[f'{name}_tension'] = gains * write.tension
        data[f'{name}_failed'] = np.array(failed)
        data[f'{name}_time'] = np.array(duration(write))
    for name, write in (('plain', WriteSettings()), ('fast', FAST.write)):
        data |= {f'{name}_{key}': value for key, value in _path(write, quality).items()}
    return data


def _path(write: WriteSettings, quality: Quality) -> Data:
    """Return time, strain and wall of one write from level 0 up."""
    segments: list[Segment] = []
    for level in range(quality.pick(1, CASE_II.levels - 1)):
        compress = CASE_II.freed_by_compression(level)
        segments += pulse(write.compression if compress else write.tension, write)
    chain = Chain(CASE_II)
    chain.place(resting_wall(CASE_II, 0))
    trace = strain_chain(chain, segments, 20.0)
    wall = wall_path(CASE_II, trace.configuration)
    return {'t': np.array(trace.t), 'strain': np.array(trace.strain), 'wall': wall}


def draw(data: Data) -> Any:
    """Draw two writes over each other, and the maps."""
    figure = new_figure(7.4, 4.8)
    upper, lower = figure.subfigures(2, 1, height_ratios=(1.0, 1.0))
    wall, strain = axes_grid(upper, 2, 1, sharex=True, height_ratios=(2.0, 1.0))[:, 0]
    for name, color in (('plain', FAINT), ('fast', S2)):
        wall.plot(data[f'{name}_t'] / 1e3, data[f'{name}_wall'], color=color, lw=0.9, label=name)
        strain.plot(data[f'{name}_t'] / 1e3, 1e3 * data[f'{name}_strain'], color=color, lw=0.8)
    wall.set(ylabel='wall $X$ (cells)')
    wall.set_yticks([CASE_II.defect(level) for level in range(0, CASE_II.levels, 2)])
    wall.legend(loc='lower right')
    label(wall, 'a', "levels 0 to 7 of the paper's element")
    strain.set(ylabel=r'$\varepsilon\times10^3$', xlabel=r'time $t\times10^{-3}$')
    titles = {'paper': 'J = 25', 'dense': 'J = 10', 'hasty': 'J = 10'}
    for axes, name, letter in zip(axes_grid(lower, 1, 3)[0], data['maps'], 'bcd', strict=True):
        x, y = 1e3 * data[f'{name}_tension'], -1e3 * data[f'{name}_compression']
        good = data[f'{name}_failed'] == 0
        axes.pcolormesh(
            x, y, good, cmap=ListedColormap(['#e8e8e8', S2]), vmin=0, vmax=1, shading='nearest',
            edgecolors='w', lw=0.4,
        )  # fmt: skip
        _, write = MAPS[str(name)]
        axes.plot(1e3 * write.tension, -1e3 * write.compression, '+', color=MARK, ms=9, mew=2)
        axes.set(xlabel=r'tension $\times10^3$')
        label(axes, letter, f'{titles[str(name)]}: {data[f"{name}_time"]:g} per level')
    lower.axes[0].set_ylabel(r'compression $\times10^3$', color=INK)
    return figure
