# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a transducer must do for kicks, in SI, so that one can be chosen: its stroke, speed, force
and power, by simulation of the fastest kick and of one that erases the last level.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import suppress

import numpy as np

from mlmem.moves.kick import KickMotion
from mlmem.physics import SUBSTEPS_PER_STEP, Chain, HeldCell, StateError, substep_times
from mlmem.physics.equilibrium import find_pinned_wall, make_blank, metamaterial_force
from mlmem.physics.values import Array

from .concern import Finding, Subject, Verdict
from .disturb import build_bare_chain


def check(subject: Subject) -> Iterator[Finding]:
    """Yield what kicks need; nothing of an element that has none."""
    design, settings = subject.design, subject.settings
    kick, limits = settings.kick, settings.transducer
    if not any(kick.wall_speeds):
        return
    chain, asked = build_bare_chain(subject.made, settings.time), {}
    with suppress(StateError):  # the last level pins no wall, as another check says
        for name, v, target, speed in (
            ('write', make_blank(subject.made), design.D_s2, max(kick.wall_speeds)),
            (
                'erase',
                find_pinned_wall(subject.made, design.levels - 1),
                design.D_s1,
                kick.erase_speed,
            ),
        ):
            chain.place(v)
            motion = KickMotion(chain.end(1), target, speed, kick)
            # longer motions demand little of a transducer
            if motion.duration <= 20_000 * chain.dt:
                min_samples = 200  # some end with a jump of the acceleration
                step = min(chain.dt, (motion.duration - kick.hold) / min_samples)
                fine = Chain(chain.specimen, step)
                fine.place(v)
                asked[name] = simulate_kick(fine, motion)
    if not asked:
        return
    scale = settings.scale
    able = {
        'stroke': (scale.length, 'm', limits.max_stroke),
        'speed': (scale.speed, 'm/s', limits.max_speed),
        'force': (scale.force, 'N', math.inf),
        'power': (scale.force * scale.speed, 'W', math.inf),
    }
    for name, (unit, symbol, most) in able.items():
        found = {each: float(np.abs(motion[name]).max()) for each, motion in asked.items()}
        beyond = [each for each in found if found[each] > most * (1 + 1e-9)]
        text = 'the most that kicks ask of the left end'
        if beyond:
            text = f'the {beyond[0]} needs more than transducer.max_* allows: it is not made'
        verdict = Verdict.WARN if beyond and settings.write.uses_kicks else Verdict.PASS
        values = {each: unit * value for each, value in found.items()}
        yield Finding(f'transducer_{name}', values, symbol, verdict, text)


def simulate_kick(chain: Chain, kick: KickMotion) -> dict[str, Array]:
    """Return stroke, speed, force and power of the left end at every step of a kick, in cells, k_r
    and time units, from the present state of a chain.

    The force moves the end cell, its spring to the next cell and its own against the substrate.
    """
    made = chain.specimen
    still = np.zeros(SUBSTEPS_PER_STEP)
    steps = math.floor(kick.duration / chain.dt)
    at = np.linspace(0.0, steps * chain.dt, steps + 1)
    place, speed = kick.evaluate_motion(at)
    short = 1e-4 * chain.dt
    acceleration = (speed - kick.evaluate_motion(np.maximum(at - short, 0.0))[1]) / short
    times = substep_times(steps, chain.dt).reshape(steps, SUBSTEPS_PER_STEP)
    states = [chain.v.copy()]
    for step_times in times:
        chain.advance(still, HeldCell(1, kick.evaluate_motion(step_times)))
        states.append(chain.v.copy())
    pull = metamaterial_force(made, np.array(states), chain.V)[:, 0]
    force = made.masses[0] * acceleration + made.eta * speed - pull
    force += made.design.friction * np.sign(speed)
    return {'stroke': place - place[0], 'speed': speed, 'force': force, 'power': force * speed}
