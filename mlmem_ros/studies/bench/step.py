# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The step: what the device relies on, against the step, and where the default stands.

No times here: errors, each against a step sixteen times below the default.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np

from ...device.settings import ProbeSettings, WriteSettings
from ...device.transducer import Transducer
from ...physics import CASE_II, Chain, substep_times, walls
from ...physics.chain import ACCURATE_STEP
from ...physics.energy import energy
from ...physics.equilibrium import resting_wall
from ...physics.potential import Array
from .comparison import Comparison
from .measure import Entry

TITLE = 'error of echo delay, wall path and energy against the step'

STEPS = tuple(ACCURATE_STEP * 2.0**k for k in (2.0, 1.5, 1.0, 0.5, 0.0, -0.5, -1.0, -2.0))
FINEST = ACCURATE_STEP / 16.0

TICK = 20.0
PROBE = ProbeSettings()
LEVELS = (0, 3, 7)


def run(repeats: int) -> list[Comparison]:
    """Return the errors; repeats would not change them."""
    entries = []
    for name, quantity in QUANTITIES.items():
        exact = quantity(_fitted(FINEST))
        for dt in STEPS:
            error = float(np.abs(quantity(_fitted(dt)) - exact).max())
            entries.append(Entry(name, (max(error, 1e-16),), dt))
    return [
        Comparison(
            'step',
            f'Error against the step; the default is {ACCURATE_STEP:g}',
            'error',
            f'against a step of {FINEST:g}; the echoes of levels {LEVELS}, a wall that is freed '
            'from level 0 and caught at level 1, and a wave packet without damping',
            entries,
            axis='step',
            measured=False,
        )
    ]


def _fitted(dt: float) -> float:
    """Return the step next to dt of which a tick is a whole number."""
    return TICK / round(TICK / dt)


def _echo_delays(dt: float) -> Array:
    return np.array([_echo_delay(level, dt) for level in LEVELS])


def _echo_delay(level: int, dt: float) -> float:
    chain = Chain(CASE_II, dt)
    chain.place(resting_wall(CASE_II, level))
    transducer = Transducer(chain, {'left': PROBE, 'right': PROBE})
    detector = transducer.fire('left')
    steps = round(TICK / dt)
    while detector.delay is None and detector.time < 1200.0:
        drive = transducer.drive(steps)
        transducer.record(chain.advance(np.zeros(2 * steps), drive))
    return np.nan if detector.delay is None else detector.delay


def _wall_path(dt: float) -> Array:
    """Return the wall's position after every tick of one write step."""
    settings = WriteSettings()
    peak = CASE_II.end_displacement(settings.compression)
    chain = Chain(CASE_II, dt)
    chain.place(resting_wall(CASE_II, 0))
    times = [0.0, settings.ramp, settings.ramp + settings.hold]
    times += [times[-1] + settings.release, times[-1] + settings.release + settings.settle]
    within = substep_times(round(TICK / dt), dt)
    path = []
    for tick in range(round(times[-1] / TICK)):
        chain.advance(peak * np.interp(TICK * tick + within, times[:4], [0.0, 1.0, 1.0, 0.0]))
        path.append(walls(CASE_II, chain.configuration)[0].position)
    return np.array(path)


def _resting_place(dt: float) -> Array:
    return _wall_path(dt)[-1:]


def _energy(dt: float) -> Array:
    """Return the energy of a packet after 2000 time units without damping, over its own."""
    design = dataclasses.replace(CASE_II, eta=0.0)
    rest = resting_wall(design, 3)
    packet = 0.01 * np.exp(-(((design.sites - 40.0) / 8.0) ** 2)) * np.sin(1.2 * design.sites)
    chain = Chain(design, dt)
    chain.place(rest)
    ground = energy(chain).total
    chain.place(rest + packet)
    start = energy(chain).total
    chain.rest(round(2000.0 / dt))
    return np.array([(energy(chain).total - ground) / (start - ground)])


QUANTITIES: dict[str, Callable[[float], Array]] = {
    'echo delay, time units': _echo_delays,
    'wall path, sites': _wall_path,
    'resting place, sites': _resting_place,
    'energy after 2000': _energy,
}
