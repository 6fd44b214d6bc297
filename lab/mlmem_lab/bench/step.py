# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The step: errors that matter to the device against the step, and where the default is.

No times here: errors of both integrators against the fourth-order one at a fine step.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable

import numpy as np

from mlmem.instrument.drivers import Simulation
from mlmem.instrument.end import End
from mlmem.instrument.motion import Cycle
from mlmem.instrument.transducer import Transducer
from mlmem.move_settings import WriteSettings
from mlmem.physics import CASE_II, INTEGRATORS, NOH_BATHE, PEFRL, Chain, Integrator, Specimen
from mlmem.physics.energy import energy
from mlmem.physics.equilibrium import find_pinned_wall
from mlmem.physics.potential import Array
from mlmem.settings import Settings

from ..studies.trace import strain_chain, wall_path
from .measure import Comparison, Entry

TITLE = 'error of echo delay, wall path and energy against the step'

STEP_FACTORS = {NOH_BATHE: (4.0, 2.0), PEFRL: (2.0,)}
"""Further steps relative to the default: stable but not accurate ones."""

FINEST_STEP = 1.0 / 32.0

TICK_TIME = 20.0
TESTED_LEVELS = (0, 3, 7)


def run(repeats: int) -> list[Comparison]:
    """Return the errors of both integrators; repeats would not change them."""
    exact = {
        name: quantity(_fit_step(FINEST_STEP), PEFRL)
        for name, quantity in ERROR_QUANTITIES.items()
    }
    return [_compare_errors(integrator, exact) for integrator in INTEGRATORS.values()]


def _compare_errors(integrator: Integrator, exact: dict[str, Array]) -> Comparison:
    default = integrator.accurate_step
    entries = []
    for name, quantity in ERROR_QUANTITIES.items():
        for factor in (*STEP_FACTORS[integrator], 2.0**0.5, 1.0, 0.5**0.5, 0.5, 0.25):
            error = np.abs(quantity(_fit_step(factor * default), integrator) - exact[name]).max()
            entries.append(Entry(name, (max(float(error), 1e-16),), factor * default))
    return Comparison(
        f'step_{integrator.name}',
        f'Error of {integrator.name} against the step; the default is {default:g}',
        'error',
        f'against pefrl with a step of {FINEST_STEP:g}; the echoes of levels {TESTED_LEVELS}, a '
        f'wall that is '
        'freed from level 0 and caught at level 1, and a wave packet without damping',
        entries,
        axis='step',
        measured=False,
    )


def _fit_step(dt: float) -> float:
    """Return the step nearest to dt that divides a tick."""
    return TICK_TIME / round(TICK_TIME / dt)


def _echo_delays(dt: float, integrator: Integrator) -> Array:
    """Return the echo delays of `TESTED_LEVELS` at the left end, NaN without an echo."""
    return np.array([_echo_delay(level, dt, integrator) for level in TESTED_LEVELS])


def _echo_delay(level: int, dt: float, integrator: Integrator) -> float:
    chain = Chain(CASE_II, dt, integrator)
    chain.place(find_pinned_wall(Specimen(CASE_II), level))
    transducer = Transducer(CASE_II, Settings(), Simulation(chain))
    detector = transducer.fire(End.LEFT)
    steps = round(TICK_TIME / dt)
    while detector.delay is None and detector.time < 1200.0:
        held_cell = transducer.held_cell(steps)
        transducer.record(chain.advance(np.zeros(integrator.substeps * steps), held_cell))
    return np.nan if detector.delay is None else detector.delay


@functools.cache
def _wall_path(dt: float, integrator: Integrator) -> Array:
    """Return the wall's position after every tick of a step from level 0 to 1."""
    write = WriteSettings()
    chain = Chain(CASE_II, dt, integrator)
    chain.place(find_pinned_wall(Specimen(CASE_II), 0))
    trace = strain_chain(chain, Cycle.plan_cycle(write, write.compression), TICK_TIME)
    return wall_path(CASE_II, trace.configuration)


def _energy_ratio(dt: float, integrator: Integrator) -> Array:
    """Return the energy of a packet after 2000 time units without damping, over its own."""
    design = dataclasses.replace(CASE_II, eta=0.0)
    rest = find_pinned_wall(Specimen(design), 3)
    packet = 0.01 * np.exp(-(((design.sites - 40.0) / 8.0) ** 2)) * np.sin(1.2 * design.sites)
    chain = Chain(design, dt, integrator)
    chain.place(rest)
    ground = energy(chain).total
    chain.place(rest + packet)
    start = energy(chain).total
    chain.rest(round(2000.0 / dt))
    return np.array([(energy(chain).total - ground) / (start - ground)])


ERROR_QUANTITIES: dict[str, Callable[[float, Integrator], Array]] = {
    'echo delay, time units': _echo_delays,
    'wall path, sites': _wall_path,
    'resting place, sites': lambda dt, integrator: _wall_path(dt, integrator)[-1:],
    'energy after 2000': _energy_ratio,
}
