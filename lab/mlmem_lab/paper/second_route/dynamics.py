# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Histories by the kernel and by SciPy's DOP853: a strain cycle and an echo."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator

import numpy as np

from mlmem_ros.device.end import Pulse
from mlmem_ros.device.motion import Cycle
from mlmem_ros.device.settings import CycleSettings, WriteSettings
from mlmem_ros.physics import CASE_II, NOH_BATHE, Chain, Specimen
from mlmem_ros.physics.equilibrium import resting_wall

from ...studies.trace import strain_chain, wall_position
from ..echoes import PAPER, detect, listen
from ..figure import Data, Quality
from . import TwoWays
from . import equations as other


def dynamics(quality: Quality, data: Data) -> Iterator[TwoWays]:
    """Yield a strain cycle (its first ramp, if small) and an echo, by kernel and DOP853."""
    design = dataclasses.replace(CASE_II, N=quality.pick(80, 110))
    cycle = Cycle.planned(CycleSettings(), WriteSettings().compression)
    cycle = Cycle(cycle.motions[: quality.pick(1, 4)])
    start = resting_wall(Specimen(design), 0)
    at = quality.pick(50.0, 20.0)
    chain = Chain(design)
    chain.place(start)
    trace = strain_chain(chain, cycle, at)
    scale = design.end_displacement(1.0)
    clock = np.array(trace.t)
    states = other.integrate(
        other.equation_1a(design, lambda t: scale * float(cycle.strain(np.array(t)))),
        np.concatenate((start, np.zeros(design.N))), (0.0, float(clock[-1])), clock,
    )  # fmt: skip
    shape = other.substrate_shape(design)
    fields = [
        state[: design.N] - scale * cycle.strain(np.array(t)) * shape
        for t, state in zip(clock, states, strict=True)
    ]
    ours = np.array([wall_position(design, field) for field in trace.configuration])
    theirs = np.array([wall_position(design, field) for field in fields])
    data |= {'wall_ours': ours, 'wall_theirs': theirs}
    yield TwoWays('wall at the end of the schedule', ours[-1], theirs[-1], 'DOP853')
    moves = [_passage(clock, path, 35.0) for path in (ours, theirs)]
    yield TwoWays('time at which it passes j = 35', moves[0], moves[1], 'DOP853')
    yield from _echo()


def _echo() -> Iterator[TwoWays]:
    design = dataclasses.replace(CASE_II, N=110)
    v = resting_wall(Specimen(design), 1)
    pulse = Pulse(float(v[0]), PAPER)
    dt = 0.25
    held_for, duration = pulse.duration, 400.0
    held = other.equation_1a(design, lambda _: 0.0, lambda t: float(pulse.at(np.array(t))[0]))
    free = other.equation_1a(design, lambda _: 0.0)
    before = dt * np.arange(1.0, round(held_for / dt) + 1)
    after = dt * np.arange(len(before) + 1.0, round(duration / dt) + 1)
    driven = other.integrate(
        held, np.concatenate((v, np.zeros(design.N))), (0.0, held_for), before
    )
    state = driven[-1].copy()
    state[0], state[design.N] = pulse.at(np.array(held_for))
    rang = other.integrate(free, state, (held_for, duration), after)
    first = np.concatenate((pulse.at(before)[0], rang[:, 0])) - v[0]
    echo = detect(first, dt, PAPER)
    kernel, _ = listen(design, v, PAPER, duration=duration, dt=dt, integrator=NOH_BATHE)
    fine, step = listen(design, v, PAPER, duration=duration, dt=dt / 10.0, integrator=NOH_BATHE)
    ours, finer = detect(kernel, dt, PAPER), detect(fine, step, PAPER)
    late = echo.t > held_for + 60.0
    yield TwoWays('echo delay, wall at j = 50', _number(ours.delay), _number(echo.delay), 'DOP853')
    yield TwoWays('greatest v_c of the echo x 1e3', 1e3 * float(ours.v_c[late].max()),
              1e3 * float(echo.v_c[late].max()), 'DOP853')  # fmt: skip
    late = finer.t > held_for + 60.0
    yield TwoWays('greatest v_c x 1e3, a tenth of the step', 1e3 * float(finer.v_c[late].max()),
              1e3 * float(echo.v_c[echo.t > held_for + 60.0].max()), 'DOP853')  # fmt: skip
    yield TwoWays('echo delay, a tenth of the step', _number(finer.delay), _number(echo.delay),
              'DOP853')  # fmt: skip
    sampled = fine[9::10]
    yield TwoWays('v_1 at t = 300 x 1e3, a tenth of the step', 1e3 * float(sampled[1199]),
              1e3 * float(first[1199]), 'DOP853')  # fmt: skip


def _passage(t: np.ndarray, path: np.ndarray, where: float) -> float:
    """Return when a path first passes a place, linear between two looks."""
    after = int(np.argmax(path > where))
    share = (where - path[after - 1]) / (path[after] - path[after - 1])
    return float(t[after - 1] + share * (t[after] - t[after - 1]))


def _number(value: float | None) -> float:
    return math.nan if value is None else value
