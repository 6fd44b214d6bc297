# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Ours: how fast a write can be: the paper's element, written slowly and fast."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from mlmem_ros.checks.bare import departures
from mlmem_ros.device.motion import Cycle
from mlmem_ros.device.settings import WriteSettings, peak
from mlmem_ros.parameter_file import load
from mlmem_ros.physics import Chain, Design, Specimen
from mlmem_ros.physics.equilibrium import resting_wall

from ...studies import style
from ...studies.trace import strain_chain, wall_path
from ..figure import Data, Figure, Quality

FIGURE = Figure(
    'fast',
    'How fast a write can be',
    seconds=2,
)

SCHEDULES = {'plain': 'bits_3', 'fast': 'fast'}
"""Presets of the paper's element: with its slow ramps, and with ours."""


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


@FIGURE.data
def compute(quality: Quality) -> Data:
    """Follow a write from level 0 up: time, strain and the wall, by schedule."""
    data: Data = {}
    for kind, name in SCHEDULES.items():
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
    """Draw two writes over each other."""
    figure = style.new_figure(3.4)
    wall, strain = style.stacked(figure)[:, 0]
    for name, color in (('plain', style.FAINT), ('fast', style.S2)):
        t = data[f'{name}_t'] / 1e3
        wall.plot(t, data[f'{name}_wall'], color=color, label=name)
        strain.plot(t, 1e3 * data[f'{name}_strain'], color=color)
    wall.set(ylabel='wall $X$ (cells)')
    wall.legend(loc='lower right')
    style.label(wall, 'a', "levels 0 to 7 of the paper's element")
    strain.set(ylabel=style.STRAIN, xlabel=style.TIME)
    return figure
