# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The wall of a memory: pinned, heard, kicked; and a byte of walls."""

import math
from dataclasses import replace
from functools import partial

import numpy as np

from mlmem import load_element
from mlmem.instrument.end import Pulse
from mlmem.moves.kick import KickMotion, KickSettings
from mlmem.physics import CASE_I, CASE_II, Chain, Design, Specimen
from mlmem.physics.energy import energy
from mlmem.physics.equilibrium import make_blank
from mlmem.settings import ProbeSettings

from ..paper.echoes import drive_end
from .problem import Answers, StandardProblem, crossing_site


def _start_chain(design: Design, site: float, width: float, dt: float) -> Chain:
    """Return a chain at rest with a wall."""
    chain = Chain(design, dt)
    middle, half = 0.5 * (design.D_s1 + design.D_s2), 0.5 * (design.D_s2 - design.D_s1)
    chain.place(middle - half * np.tanh((design.sites - site) / width))
    return chain


def _kick_wall(chain: Chain, moving: float, late: float, mark: float) -> tuple[float, float]:
    """Kick a wall into a blank chain, and wait until it has passed a cell.

    Returns:
        The energy over that of the blank chain when the end is let go, held for 20 after its
        move, and the time at which the wall passes the cell.
    """
    design, before = chain.design, energy(chain).total
    speed = (design.D_s2 - design.D_s1) / moving
    shape = KickSettings(late=late, hold=20.0)
    drive_end(chain, KickMotion(design.D_s1, design.D_s2, speed, shape), moving + shape.hold)
    put_in = energy(chain).total - before
    places = [crossing_site(chain.configuration, design.D_barrier)]
    while not places[-1] >= mark and len(places) < 1_000:
        chain.advance_steps(round(1.0 / chain.dt))
        places.append(crossing_site(chain.configuration, design.D_barrier))
    share = (mark - places[-2]) / (places[-1] - places[-2])
    return put_in, chain.time - 1.0 + share


@partial(StandardProblem, 'pinning', 0.1)
def pinning(dt: float) -> Answers:
    """A soft defect stops a wall.

    The paper's Case I (Table I), no strain. X = 50, w = 8. *farthest* place of the wall in 12 000,
    looked at once per unit of time, and where it comes to *rest*.
    """
    chain, places = _start_chain(CASE_I, 50.0, 8.0, dt), []
    for _ in range(12_000):
        chain.advance_steps(round(1.0 / dt))
        places.append(crossing_site(chain.v, CASE_I.D_barrier))
    return {'farthest': max(places), 'rest': places[-1]}


@partial(StandardProblem, 'echo', 0.05)
def echo(dt: float) -> Answers:
    """An echo of a wall.

    The paper's Case II. X = 100, w = 4, 6000 of rest. Then v_1 is held at its place plus 0.01
    exp(-((t - 48)/8)^2/2) sin(1.5 t), with the velocity of that, for t up to 96; free afterwards.
    |v_1 - place| over 600 is averaged in a centred box of 16 pi / 1.5. *delay*: when it is largest
    after t = 144, minus 48. *loudness*: that maximum.
    """
    pulse = ProbeSettings(A=0.01, sigma=8.0, omega_c=1.5)
    chain = _start_chain(CASE_II, 100.0, 4.0, dt)
    chain.advance_steps(round(6_000.0 / dt))
    home = chain.end(1)
    heard = drive_end(chain, Pulse(home, pulse), 600.0) - home
    box = round(16.0 * math.pi / pulse.omega_c / dt)
    smooth = np.convolve(np.abs(heard), np.full(box, 1.0 / box), 'same')
    late = round(144.0 / dt)
    loudest = late + int(np.argmax(smooth[late:]))
    return {'delay': (loudest + 1) * dt - 48.0, 'loudness': float(smooth[loudest])}


@partial(StandardProblem, 'kick', 0.05)
def kick(dt: float) -> Answers:
    """A wall is kicked from an end, without strain, and stops at a defect.

    Case II with N = 225, rigid substrate, all cells inactive and at rest. v_1 goes from D_s1 to
    D_s2 along 3 x^2 - 2 x^3 in 2 / 0.08 = 25 units, held for 20, then free. *time to cell 60*;
    *place after 1000*, both from the start; *rest*, the place 10 000 later; *energy*, over that of
    the blank one, when the end is let go.
    """
    chain = Chain(CASE_II, dt)
    put_in, arrival = _kick_wall(chain, 25.0, 0.0, 60.0)
    chain.advance_steps(round((1_000.0 - chain.time) / dt))
    place = crossing_site(chain.configuration, CASE_II.D_barrier)
    chain.advance_steps(round(10_000.0 / dt))
    return {
        'energy': put_in,
        'time to cell 60': arrival,
        'place after 1000': place,
        'rest': crossing_site(chain.configuration, CASE_II.D_barrier),
    }


@partial(StandardProblem, 'byte', 0.025)
def byte(dt: float) -> Answers:
    """Five kicks write a byte, and one pulse hears it.

    The start and the kicks are as in 3, but to and fro: v_1 to D_s2, to D_s1, ... five times, at
    mean speeds of 0.26, 0.08, 0.035, 0.011 and 0.004; after each it is held for 20, and free for
    1000. *wall 0* ... *wall 7*, 6000 later: where the configuration passes the barrier, linear
    between sites. Then a pulse as in 2, of 0.01, sigma 16 and frequency 1.7, for t up to 192.
    *echo*: the root mean square of v_1 - place during the 900 after it.
    """
    chain, wells = Chain(CASE_II, dt), (CASE_II.D_s1, CASE_II.D_s2)
    for number, speed in enumerate((0.26, 0.08, 0.035, 0.011, 0.004)):
        shape = KickSettings(late=0.0, hold=20.0)
        motion = KickMotion(wells[number % 2], wells[1 - number % 2], speed, shape)
        drive_end(chain, motion, motion.duration)
        chain.advance_steps(round(1_000.0 / dt))
    chain.advance_steps(round(6_000.0 / dt))
    over = chain.configuration - CASE_II.D_barrier
    sites = np.flatnonzero(over[:-1] * over[1:] < 0.0)
    places = sites + 1 + over[sites] / (over[sites] - over[sites + 1])
    pulse = ProbeSettings(A=0.01, sigma=16.0, omega_c=1.7)
    home = chain.end(1)
    heard = drive_end(chain, Pulse(home, pulse), 192.0 + 900.0)[round(192.0 / dt) :] - home
    found = dict(zip((0, 1, 2, 5, 7), places.tolist(), strict=True))
    loud = float(np.sqrt(np.mean(np.square(heard))))
    return {**{f'wall {level}': place for level, place in found.items()}, 'echo': loud}


@partial(StandardProblem, 'robust kick', 0.05)
def robust_kick(dt: float) -> Answers:
    """A kick brings a wall to the same level of an ideal element and of one of uneven parts.

    The paper's potential with d = 0.0129, N = 72, eta = 0.0221, all cells inactive and at rest.
    alpha_j = (1 + 0.0031 j) f_j: f is 0.15 at j = 8, 16, ... 64, 0.49 next to these, 1.29 from 69
    on, and 1 elsewhere. v_1 goes from D_s1 to D_s2 along 3 x^2 - 2 x^3 in 17.5 units, x being the
    square of the elapsed share, held for 20, then free. *energy*, over that of the blank one, when
    the end is let go; *time to cell 20*, from the start; *rest*, the place 2000 later. The same
    with alpha_j times 1 + 0.03 sqrt(2) sin(j^2), springs j + 1/2 times
    1 + 0.03 sqrt(2) sin(2 j^2) and masses times 1 + 0.03 sqrt(2) sin(3 j^2): *uneven energy*,
    *uneven time*, *uneven rest*.
    """
    design = replace(load_element('robust_3').design, eta=0.0221)  # of the published answers
    j, size = design.sites, 0.03 * math.sqrt(2.0)
    uneven = Specimen(
        design, alpha_factor=1.0 + size * np.sin(j**2),
        k_r_factor=1.0 + size * np.sin(2.0 * j[:-1] ** 2), mass=1.0 + size * np.sin(3.0 * j**2),
    )  # fmt: skip
    found: Answers = {}
    for specimen, kind in ((Specimen(design), ''), (uneven, 'uneven ')):
        chain = Chain(specimen, dt)
        chain.place(make_blank(specimen))
        put_in, arrival = _kick_wall(chain, 17.5, 1.0, 20.0)
        chain.advance_steps(round(2_000.0 / dt))
        time_name = f'{kind}time' if kind else 'time to cell 20'
        rest = crossing_site(chain.configuration, design.D_barrier)
        found |= {f'{kind}energy': put_in, time_name: arrival, f'{kind}rest': rest}
    return found
