# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The wall of a memory: pinned, heard, kicked; and a byte of walls."""

import math

import numpy as np

from mlmem.physics import CASE_I, CASE_II, Chain, Design, HeldCell, Integrator, substep_times
from mlmem.physics.energy import energy
from mlmem.physics.potential import Array

from .problem import Answers, crossing_site, define_problem


def _start_chain(design: Design, site: float, width: float, dt: float, by: Integrator) -> Chain:
    """Return a chain at rest with a wall."""
    chain = Chain(design, dt, by)
    middle, half = 0.5 * (design.D_s1 + design.D_s2), 0.5 * (design.D_s2 - design.D_s1)
    chain.place(middle - half * np.tanh((design.sites - site) / width))
    return chain


def _record_echo(
    chain: Chain, amplitude: float, sigma: float, omega: float, steps: int, free: bool
) -> Array:
    """Return v_1 less its place after every step, from the start of a pulse on: that and its
    decay, or with `free` so many steps after it.
    """
    home, t0, dt, integrator = chain.end(1), 6.0 * sigma, chain.dt, chain.integrator
    held = round(2.0 * t0 / dt)
    t = substep_times(held, dt, integrator)
    envelope = amplitude * np.exp(-0.5 * ((t - t0) / sigma) ** 2)
    sine, cosine = np.sin(omega * t), omega * np.cos(omega * t)
    motion = np.array([home + envelope * sine, envelope * (cosine - (t - t0) / sigma**2 * sine)])
    V_N = np.zeros(integrator.substeps * (steps + held * free))
    heard = chain.advance(V_N, HeldCell(1, motion))[0] - home
    return np.asarray(heard[held * free :])


def _moved_cell(t: Array, home: float, goal: float, moving: float) -> HeldCell:
    """Return the first cell, moved along 3 x^2 - 2 x^3 from one place to another and held."""
    x, way = np.minimum(t / moving, 1.0), goal - home
    velocity = np.where(t < moving, 6.0 * way * x * (1.0 - x) / moving, 0.0)
    return HeldCell(1, np.stack((home + way * x * x * (3.0 - 2.0 * x), velocity)))


@define_problem('pinning', 0.1)
def pinning(integrator: Integrator, dt: float) -> Answers:
    """A soft defect stops a wall.

    The paper's Case I (Table I), no strain. X = 50, w = 8. *farthest* place of the wall in 12 000,
    looked at once per unit of time, and where it comes to *rest*.
    """
    chain, places = _start_chain(CASE_I, 50.0, 8.0, dt, integrator), []
    for _ in range(12_000):
        chain.rest(round(1.0 / dt))
        places.append(crossing_site(chain.v, CASE_I.D_barrier))
    return {'farthest': max(places), 'rest': places[-1]}


@define_problem('echo', 0.05)
def echo(integrator: Integrator, dt: float) -> Answers:
    """An echo of a wall.

    The paper's Case II. X = 100, w = 4, 6000 of rest. Then v_1 is held at its place plus 0.01
    exp(-((t - 48)/8)^2/2) sin(1.5 t), with the velocity of that, for t up to 96; free afterwards.
    |v_1 - place| over 600 is averaged in a centred box of 16 pi / 1.5. *delay*: when it is largest
    after t = 144, minus 48. *loudness*: that maximum.
    """
    sigma, carrier = 8.0, 1.5
    chain = _start_chain(CASE_II, 100.0, 4.0, dt, integrator)
    chain.rest(round(6_000.0 / dt))
    heard = _record_echo(chain, 0.01, sigma, carrier, round(600.0 / dt), free=False)
    box = round(16.0 * math.pi / carrier / dt)
    smooth = np.convolve(np.abs(heard), np.full(box, 1.0 / box), 'same')
    late = round(18.0 * sigma / dt)
    loudest = late + int(np.argmax(smooth[late:]))
    return {'delay': (loudest + 1) * dt - 6.0 * sigma, 'loudness': float(smooth[loudest])}


@define_problem('kick', 0.05)
def kick(integrator: Integrator, dt: float) -> Answers:
    """A wall is kicked from an end, without strain, and stops at a defect.

    Case II with N = 225, rigid substrate, all cells inactive and at rest. v_1 goes from D_s1 to
    D_s2 along 3 x^2 - 2 x^3 in 2 / 0.08 = 25 units, held for 20, then free. *time to cell 60*;
    *place after 1000*, both from the start; *rest*, the place 10 000 later; *energy*, over that of
    the blank one, when the end is let go.
    """
    moving, held, mark = 25.0, 20.0, 60.0
    chain = Chain(CASE_II, dt, integrator)
    before = energy(chain).total
    t = substep_times(round((moving + held) / dt), dt, integrator)
    chain.advance(np.zeros(len(t)), _moved_cell(t, CASE_II.D_s1, CASE_II.D_s2, moving))
    put_in = energy(chain).total - before
    places = [crossing_site(chain.configuration, CASE_II.D_barrier)]
    for _ in range(round(1_000.0 - moving - held)):
        chain.rest(round(1.0 / dt))
        places.append(crossing_site(chain.configuration, CASE_II.D_barrier))
    chain.rest(round(10_000.0 / dt))
    passed = int(np.argmax(np.nan_to_num(places) >= mark))
    share = (mark - places[passed - 1]) / (places[passed] - places[passed - 1])
    return {
        'energy': put_in,
        'time to cell 60': moving + held + passed - 1 + float(share),
        'place after 1000': places[-1],
        'rest': crossing_site(chain.configuration, CASE_II.D_barrier),
    }


@define_problem('byte', 0.025)
def byte(integrator: Integrator, dt: float) -> Answers:
    """Five kicks write a byte, and one pulse hears it.

    The start and the kicks are as in 7, but to and fro: v_1 to D_s2, to D_s1, ... five times, at
    mean speeds of 0.26, 0.08, 0.035, 0.011 and 0.004; after each it is held for 20, and free for
    1000. *wall 0* ... *wall 7*, 6000 later: where the configuration passes the barrier, linear
    between sites. Then a pulse as in 5, of 0.01, sigma 16 and frequency 1.7, for t up to 192.
    *echo*: the root mean square of v_1 - place during the 900 after it.
    """
    chain, wells = Chain(CASE_II, dt, integrator), (CASE_II.D_s1, CASE_II.D_s2)
    for number, speed in enumerate((0.26, 0.08, 0.035, 0.011, 0.004)):
        home, goal = wells[number % 2], wells[1 - number % 2]
        moving = abs(goal - home) / speed
        t = substep_times(round((moving + 20.0) / dt), dt, integrator)
        chain.advance(np.zeros(len(t)), _moved_cell(t, home, goal, moving))
        chain.rest(round(1_000.0 / dt))
    chain.rest(round(6_000.0 / dt))
    over = chain.configuration - CASE_II.D_barrier
    sites = np.flatnonzero(over[:-1] * over[1:] < 0.0)
    places = sites + 1 + over[sites] / (over[sites] - over[sites + 1])
    heard = _record_echo(chain, 0.01, 16.0, 1.7, round(900.0 / dt), free=True)
    found = dict(zip((0, 1, 2, 5, 7), places.tolist(), strict=True))
    loud = float(np.sqrt(np.mean(np.square(heard))))
    return {**{f'wall {level}': place for level, place in found.items()}, 'echo': loud}
