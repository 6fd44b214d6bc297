# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Ours: the independent check, every quantity by a second route that shares no code with it.

SciPy's DOP853 on the equations as printed (`equations`), closed forms, the continuum's wall and
minimisers.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from mlmem.instrument.end import Pulse
from mlmem.instrument.motion import Cycle
from mlmem.move_settings import CycleSettings, WriteSettings
from mlmem.physics import CASE_I, CASE_II, NOH_BATHE, Chain, Design, Specimen
from mlmem.physics.equilibrium import find_pinned_wall
from mlmem.physics.held_wall import hold_walls, make_uniform
from mlmem.physics.waves import pass_band
from mlmem_tools.checks.quasistatic import MAX_PINNED_DISTANCE, find_depinning_strain

from ...landscapes import fit_kink
from ...studies.trace import strain_chain, wall_position
from .. import equations as other
from ..echoes import PAPER_PROBE, detect_echo, record_echo
from ..figure import Data, Figure, Judged, Quality, judge_numbers
from .fig_2b import MAX_STRAIN


class TwoWays(NamedTuple):
    """One quantity by two routes."""

    quantity: str
    ours: float
    theirs: float
    route: str


# --- without time: potential, bands, resting walls, equilibria, de-pinning ---------------------


def check_potential() -> Iterator[TwoWays]:
    """Yield ground states, stiffnesses and the strained substrate's shape."""
    p = CASE_II
    for number, D in enumerate(other.ground_states(p)):
        ours, k = ((p.D_s1, p.k_s1), (p.D_s2, p.k_s2))[number]
        name = f's{number + 1}'
        yield TwoWays(f'ground state {name}', ours, D, 'SciPy minimize_scalar on psi')
        bend = float(other.psi_second(p, np.array(D)))
        yield TwoWays(f'stiffness k_{name}, Case II', k, bend, 'complex step and difference')
    shape = other.substrate_shape(p)
    middle = p.N // 2
    yield TwoWays(
        'substrate V_j at mid-span for V_N = 1', float(p.strain_shape[middle - 1]),
        float(shape[middle - 1]), 'linear solve of the springs',
    )  # fmt: skip


def check_waves(quality: Quality) -> Iterator[TwoWays]:
    """Yield the band edges: Eq. (4) against eigenvalues of a periodic ring of cells."""
    n = quality.pick(50, 200)
    ring = 2.0 * np.eye(n) - np.roll(np.eye(n), 1, 0) - np.roll(np.eye(n), -1, 0)
    for name, k_s in (('s1', CASE_II.k_s1), ('s2', CASE_II.k_s2)):
        D = other.ground_states(CASE_II)[0 if name == 's1' else 1]
        on_site = float(other.psi_second(CASE_II, np.array(D)))
        omega = np.sqrt(np.linalg.eigvalsh(ring + on_site * np.eye(n)))
        for edge, ours, theirs in zip(
            ('lower', 'upper'), pass_band(k_s), (omega[0], omega[-1]), strict=True
        ):
            yield TwoWays(f'{edge} band edge of {name}', ours, float(theirs), f'ring of {n} cells')


def check_continuum() -> Iterator[TwoWays]:
    """Yield the resting wall: held-wall Newton against the continuum and a root finder."""
    from scipy.optimize import root

    for name, design in (('I', CASE_I), ('II', CASE_II)):
        flat = make_uniform(design)
        X = flat.N // 2 + np.arange(0.0, 1.0, 1.0 / 32.0)
        held = hold_walls(Specimen(flat), X, np.zeros(flat.N))
        least = int(held.energy.argmin())
        yield TwoWays(
            f'wall energy, Case {name}', float(held.energy.mean()), other.kink_energy(flat),
            'continuum: integral of sqrt(2 psi)',
        )  # fmt: skip
        middle = int(X[least])
        slope = float(held.v[least][middle - 1] - held.v[least][middle])
        exact = other.kink_profile(flat, flat.sites - X[least])
        theirs = float(exact[middle - 1] - exact[middle])
        yield TwoWays(
            f'wall width, Case {name}',
            _wall_width(flat, slope),
            _wall_width(flat, theirs),
            "continuum: v' = -sqrt(2 psi)",
        )
    # Minimum and maximum of the Peierls-Nabarro potential are equilibria: find both by a root
    # finder on the literal forces (Case II; in Case I the barrier is below rounding).
    ends = []
    for i in (int(held.energy.argmin()), int(held.energy.argmax())):
        solution = root(
            lambda v: other.energy_gradient(flat, v, np.zeros(flat.N)),
            held.v[i],
            method='hybr',
            tol=1e-13,
        )
        ends.append(other.total_energy(flat, solution.x, np.zeros(flat.N)))
    yield TwoWays(
        'Peierls-Nabarro barrier, Case II', float(np.ptp(held.energy)), ends[1] - ends[0],
        'SciPy root: saddle less minimum',
    )  # fmt: skip
    walls = other.kink_profile(flat, (flat.sites - X[:, None]).ravel()).reshape(len(X), flat.N)
    bare = [other.total_energy(flat, wall, np.zeros(flat.N)) for wall in walls]
    yield TwoWays(
        'Peierls-Nabarro barrier, unrelaxed', float(np.ptp(held.energy)),
        float(np.ptp(bare)), 'continuum wall put on the lattice, not relaxed',
    )  # fmt: skip


def _wall_width(design: Design, drop: float) -> float:
    """Return the width of a wall: its step over the drop between the two cells it is between."""
    return (design.D_s2 - design.D_s1) / drop


def kink_fit(quality: Quality) -> TwoWays:
    """Return the error of the arctan ansatz: our fit against SciPy's from random starts."""
    from scipy.optimize import least_squares

    flat = make_uniform(CASE_I)
    X = flat.N // 2 + 0.5
    (v,) = hold_walls(Specimen(flat), np.array([X]), np.zeros(flat.N)).v
    x, y = flat.sites - X, v - flat.D_s1

    def kink_residual(c: np.ndarray) -> np.ndarray:
        powers = np.exp(np.clip(np.outer([c[2], c[4]], x), -300.0, 300.0))
        return np.asarray(c[0] * np.arctan(c[1] * powers[0] + c[3] * powers[1]) - y)

    draw = np.random.default_rng(1)
    starts = draw.uniform((1.0, 0.01, -1.5, 0.01, -1.5), (1.6, 2.0, -0.05, 2.0, -0.05),
                          (quality.pick(4, 40), 5))  # fmt: skip
    best = min(float(np.sqrt(np.mean(least_squares(kink_residual, s).fun ** 2))) for s in starts)
    return TwoWays('kink ansatz e_rms x 1e3, Case I', 1e3 * fit_kink(CASE_I).e_rms, 1e3 * best,
               'SciPy least_squares, random starts')  # fmt: skip


def check_static(quality: Quality) -> Iterator[TwoWays]:
    """Yield equilibria: Newton against SciPy's minimiser, and de-pinning by energy alone."""
    design = CASE_II
    v = find_pinned_wall(Specimen(design), 3)
    # Not from the answer: from the continuum's wall, a third of a cell off the defect.
    guess = other.kink_profile(make_uniform(design), design.sites - design.defect_site(3) - 0.35)
    yield TwoWays(
        'wall pinned at level 3',
        wall_position(design, v),
        wall_position(design, _minimise_energy(design, guess, 0.0)),
        'SciPy L-BFGS-B',
    )
    design = dataclasses.replace(CASE_I, N=150)
    signs = {'compression': -1.0, 'tension': 1.0}
    for name in quality.pick(['compression'], signs):
        sign = signs[name]
        limit = abs(find_depinning_strain(design, 0, sign, MAX_STRAIN))
        yield TwoWays(f'de-pinning {name} x 1e3, N = 150', 1e3 * limit,
                  1e3 * _leaving_strain(design, sign, limit, quality.pick(6e-3, 3e-4)),
                  'SciPy L-BFGS-B, halving')  # fmt: skip


def _minimise_energy(design: Design, v: np.ndarray, strain: float) -> np.ndarray:
    from scipy.optimize import minimize

    V = design.end_displacement(strain) * other.substrate_shape(design)

    def has_left(v: np.ndarray) -> None:
        if abs(wall_position(design, v - V) - start) > MAX_PINNED_DISTANCE:
            raise StopIteration  # it has left its site: where it goes does not matter

    start = wall_position(design, v - V)
    options = {'maxiter': 20000, 'maxfun': 40000, 'ftol': 1e-16, 'gtol': 1e-10, 'maxls': 50}
    found = minimize(
        lambda v: other.energy_and_gradient(design, v, V), v, jac=True, callback=has_left,
        method='L-BFGS-B', options=options,
    )  # fmt: skip
    return np.asarray(found.x)


def _leaving_strain(design: Design, sign: float, near: float, resolution: float) -> float:
    """Return the strain at which a wall followed by a minimiser leaves its defect.

    It is looked for from 7 % below to 10 % above a strain, by halving down to a share of it; NaN
    where it is not there.
    """
    shape = design.end_displacement(sign) * other.substrate_shape(design)
    strain, v = 0.0, find_pinned_wall(Specimen(design), 0)

    def wall_shift(guess: np.ndarray, strain: float) -> float:
        return abs(wall_position(design, guess - strain * shape) - design.J)

    low, high = 0.93 * near, 1.1 * near  # not symmetric: the middle must not be the answer
    for after in np.linspace(0.0, low, 6)[1:]:
        v = _minimise_energy(design, v + (after - strain) * shape, sign * float(after))
        strain = float(after)
    if wall_shift(v, low) > 0.9 * MAX_PINNED_DISTANCE:
        return math.nan
    if (
        wall_shift(_minimise_energy(design, v + (high - low) * shape, sign * high), high)
        < 0.9 * MAX_PINNED_DISTANCE
    ):
        return math.nan
    while high - low > resolution * near:
        middle = 0.5 * (low + high)
        trial = _minimise_energy(design, v + (middle - low) * shape, sign * middle)
        if wall_shift(trial, middle) < 0.9 * MAX_PINNED_DISTANCE:
            v, low = trial, middle
        else:
            high = middle
    return low


# --- histories by the kernel and by DOP853 -----------------------------------------------------


def check_dynamics(quality: Quality, data: Data) -> Iterator[TwoWays]:
    """Yield a strain cycle (its first ramp, if small) and an echo, by kernel and DOP853."""
    design = dataclasses.replace(CASE_II, N=quality.pick(80, 110))
    cycle = Cycle.plan_cycle(CycleSettings(), WriteSettings().compression)
    cycle = Cycle(cycle.motions[: quality.pick(1, 4)])
    start = find_pinned_wall(Specimen(design), 0)
    at = quality.pick(50.0, 20.0)
    chain = Chain(design)
    chain.place(start)
    trace = strain_chain(chain, cycle, at)
    scale = design.end_displacement(1.0)
    clock = np.array(trace.t)
    states = other.integrate_rates(
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
    moves = [_passage_time(clock, path, 35.0) for path in (ours, theirs)]
    yield TwoWays('time at which it passes j = 35', moves[0], moves[1], 'DOP853')
    yield from _check_echo()


def _check_echo() -> Iterator[TwoWays]:
    design = dataclasses.replace(CASE_II, N=110)
    v = find_pinned_wall(Specimen(design), 1)
    pulse = Pulse(float(v[0]), PAPER_PROBE)
    dt = 0.25
    held_for, duration = pulse.duration, 400.0
    held = other.equation_1a(design, lambda _: 0.0, lambda t: float(pulse.at(np.array(t))[0]))
    free = other.equation_1a(design, lambda _: 0.0)
    before = dt * np.arange(1.0, round(held_for / dt) + 1)
    after = dt * np.arange(len(before) + 1.0, round(duration / dt) + 1)
    driven = other.integrate_rates(
        held, np.concatenate((v, np.zeros(design.N))), (0.0, held_for), before
    )
    state = driven[-1].copy()
    state[0], state[design.N] = pulse.at(np.array(held_for))
    rang = other.integrate_rates(free, state, (held_for, duration), after)
    first = np.concatenate((pulse.at(before)[0], rang[:, 0])) - v[0]
    echo = detect_echo(first, dt, PAPER_PROBE)
    kernel, _ = record_echo(design, v, PAPER_PROBE, duration=duration, dt=dt, integrator=NOH_BATHE)
    fine, step = record_echo(
        design, v, PAPER_PROBE, duration=duration, dt=dt / 10.0, integrator=NOH_BATHE
    )
    ours, finer = detect_echo(kernel, dt, PAPER_PROBE), detect_echo(fine, step, PAPER_PROBE)
    late = echo.t > held_for + 60.0
    yield TwoWays(
        'echo delay, wall at j = 50',
        _finite_number(ours.delay),
        _finite_number(echo.delay),
        'DOP853',
    )
    yield TwoWays('greatest v_c of the echo x 1e3', 1e3 * float(ours.v_c[late].max()),
              1e3 * float(echo.v_c[late].max()), 'DOP853')  # fmt: skip
    late = finer.t > held_for + 60.0
    yield TwoWays('greatest v_c x 1e3, a tenth of the step', 1e3 * float(finer.v_c[late].max()),
              1e3 * float(echo.v_c[echo.t > held_for + 60.0].max()), 'DOP853')  # fmt: skip
    yield TwoWays(
        'echo delay, a tenth of the step',
        _finite_number(finer.delay),
        _finite_number(echo.delay),
        'DOP853',
    )
    sampled = fine[9::10]
    yield TwoWays('v_1 at t = 300 x 1e3, a tenth of the step', 1e3 * float(sampled[1199]),
              1e3 * float(first[1199]), 'DOP853')  # fmt: skip


def _passage_time(t: np.ndarray, path: np.ndarray, where: float) -> float:
    """Return when a path first passes a place, linear between two looks."""
    after = int(np.argmax(path > where))
    share = (where - path[after - 1]) / (path[after] - path[after - 1])
    return float(t[after - 1] + share * (t[after] - t[after - 1]))


def _finite_number(value: float | None) -> float:
    return math.nan if value is None else value


FIGURE = Figure(
    'check',
    'The independent check: SciPy, closed forms, Newton',
    seconds=15,
)


@FIGURE.data
def compute_data(quality: Quality) -> Data:
    """Return the table, and two histories by both routes: a write's wall and an echo."""
    data: Data = {}
    rows = [
        *check_potential(),
        *check_waves(quality),
        *check_continuum(),
        kink_fit(quality),
        *check_static(quality),
        *check_dynamics(quality, data),
    ]
    data['quantity'] = np.array([row.quantity for row in rows])
    data['ours'] = np.array([row.ours for row in rows])
    data['theirs'] = np.array([row.theirs for row in rows])
    data['route'] = np.array([row.route for row in rows])
    return data


@FIGURE.register_claim(
    'Eq. (1) is integrated by the scheme of Noh and Bathe',
    page=5,
    how='kernel against SciPy DOP853 over a whole write cycle and an echo',
)
def _integrator(data: Data) -> Judged:
    rows = {
        str(name): (float(ours), float(theirs))
        for name, ours, theirs in zip(data['quantity'], data['ours'], data['theirs'], strict=True)
    }
    place = abs(np.subtract(*rows['wall at the end of the schedule']))
    delay = abs(np.subtract(*rows['echo delay, wall at j = 50']))
    coarse = rows['greatest v_c of the echo x 1e3']
    fine = rows['greatest v_c x 1e3, a tenth of the step']
    loss, remaining = (100.0 * abs(ours / theirs - 1.0) for ours, theirs in (coarse, fine))
    return judge_numbers(
        place < 0.01 and delay < 2.0 and remaining < 1.0,
        f'the wall ends within {place:.1e} cells, the echo is {delay:.2f} late. At our step of '
        f'0.25 the scheme damps the echo by {loss:.0f} %; at a tenth of it by {remaining:.2f} %',
    )
