# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Our integrators compared with general solvers, at equal error on the same problem.

Every solver has a ladder of settings (tolerances or steps) and competes with the cheapest one
whose greatest error of a displacement, against DOP853 at a tolerance of 1e-13, is at most the
target. There are two targets: the error of our default step, and a hundredth of it.

A peer is created and compiled once, and then solves from start to end at a setting: a tolerance,
relative and absolute, or a step. Velocity Verlet on our own force is one of them: order 2, one
force per step, as vectorised as our own kernels (the half drifts of two steps are joined).
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from mlmem.physics import NOH_BATHE, PEFRL, Chain, Integrator
from mlmem.physics.formulas import on_site_factors
from mlmem.physics.jit import compile_kernel, fma, inline_function
from mlmem.physics.potential import Array
from mlmem.physics.specimen import Specimen
from mlmem.physics.stepping import stable_step

from .kernel import TIME_STEP, Problem
from .measure import Comparison, Contender, measure_contenders


@inline_function
def _kick_and_drift(
    n: int, u: Array, new: Array, v: Array, height: Array,
    a: float, b: float, c: float, decay: float, kick: float, drift: float,
) -> None:  # fmt: skip
    for j in range(n):
        x = u[j + 1]
        slope, sine = on_site_factors((height, a, b), j, x + c)
        force = fma(-slope, sine, fma(-2.0, x, u[j]) + u[j + 2])
        velocity = fma(decay, v[j], kick * force)
        v[j] = velocity
        new[j + 1] = fma(drift, velocity, x)


@compile_kernel
def _advance(
    pairs: int, n: int, u: Array, new: Array, v: Array, height: Array,
    a: float, b: float, c: float, decay: float, kick: float, drift: float,
) -> None:  # fmt: skip
    """Advance by pairs of steps, from the middle of one drift to the middle of another."""
    for j in range(n):
        u[j + 1] += 0.5 * drift * v[j]
    for _ in range(pairs):
        u[0] = u[1]
        u[n + 1] = u[n]
        _kick_and_drift(n, u, new, v, height, a, b, c, decay, kick, drift)
        new[0] = new[1]
        new[n + 1] = new[n]
        _kick_and_drift(n, new, u, v, height, a, b, c, decay, kick, drift)
    for j in range(n):
        u[j + 1] -= 0.5 * drift * v[j]


def build_verlet(problem: Problem, duration: float) -> Callable[[float], Array]:
    """Return a function from the step to the displacements at the end."""
    p, height = problem.design, problem.height

    def solve_problem(dt: float) -> Array:
        pairs = round(0.5 * duration / dt)
        dt = 0.5 * duration / pairs
        decay = math.exp(-p.eta * dt)
        u, new, v = np.zeros(p.N + 2), np.zeros(p.N + 2), np.zeros(p.N)
        u[1:-1] = problem.start
        kick = (1.0 - decay) / p.eta
        _advance(pairs, p.N, u, new, v, height, p.a, p.b, p.c, decay, kick, dt)
        return u[1:-1]

    return solve_problem


SOLVER_TOLERANCES = tuple(10.0 ** (-0.5 * k) for k in range(6, 25))

RightHandSide = Callable[[float, Array], Array]


class Peer(NamedTuple):
    """A solver that is ready.

    Attributes:
        solve: From a setting to the displacements at the end, shape (N,).
    """

    ladder: Sequence[float]
    solve: Callable[[float], Array]


@compile_kernel
def _evaluate_rhs(y: Array, height: Array, eta: float, a: float, b: float, c: float) -> Array:
    """Return d(u, v)/dt: a compiled loop, which a Python solver calls."""
    n = len(height)
    out = np.empty(2 * n)
    for j in range(n):
        x = y[j]
        left = y[j - 1] if j > 0 else x
        right = y[j + 1] if j < n - 1 else x
        slope, sine = on_site_factors((height, a, b), j, x + c)
        out[j] = y[n + j]
        out[n + j] = left - 2.0 * x + right - slope * sine - eta * y[n + j]
    return out


def _build_compiled_rhs(problem: Problem) -> RightHandSide:
    p, height = problem.design, problem.height
    return lambda t, y: _evaluate_rhs(y, height, p.eta, p.a, p.b, p.c)


def _build_numpy_rhs(problem: Problem) -> RightHandSide:
    """Return the same in plain NumPy."""

    def evaluate_rhs(t: float, y: Array) -> Array:
        x, velocity = np.split(y, 2)
        return np.concatenate((velocity, problem.force(x) - problem.design.eta * velocity))

    return evaluate_rhs


def _build_dop853(
    right: Callable[[Problem], RightHandSide], problem: Problem, duration: float
) -> Peer:
    from scipy.integrate import solve_ivp

    p, rhs = problem.design, right(problem)
    start = np.concatenate((problem.start, np.zeros(p.N)))

    def solve_problem(tolerance: float) -> Array:
        options: dict[str, Any] = {'method': 'DOP853', 'rtol': tolerance, 'atol': tolerance}
        solution = solve_ivp(rhs, (0.0, duration), start, t_eval=[duration], **options)
        return np.asarray(solution.y[: p.N, -1])

    return Peer(SOLVER_TOLERANCES, solve_problem)


def _build_heyoka(problem: Problem, duration: float) -> Peer:
    """Taylor's method, compiled for every tolerance."""
    import heyoka as hy

    p, n = problem.design, problem.design.N
    u, v = hy.make_vars(*(f'u{j}' for j in range(n))), hy.make_vars(*(f'v{j}' for j in range(n)))
    equations = []
    for j in range(n):
        force = problem.on_site(u[j], float(problem.height[j]), hy.sin)
        pull = hy.sum([u[max(j - 1, 0)], u[min(j + 1, n - 1)], -2.0 * u[j]])
        equations += [(u[j], v[j]), (v[j], pull - force - p.eta * v[j])]
    start = np.zeros(2 * n)
    start[::2] = problem.start

    @functools.cache
    def build_integrator(tolerance: float) -> Any:
        return hy.taylor_adaptive(equations, start, tol=tolerance, compact_mode=True)

    def solve_problem(tolerance: float) -> Array:
        taylor = build_integrator(tolerance)
        taylor.time = 0.0
        taylor.state[:] = start
        taylor.propagate_until(duration)
        return np.array(taylor.state[::2])

    return Peer((1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8), solve_problem)


def _build_diffrax(problem: Problem, duration: float) -> Peer:
    import diffrax
    import jax
    import jax.numpy as jnp

    jax.config.update('jax_enable_x64', True)
    p, height = problem.design, jnp.asarray(problem.height)

    def evaluate_rhs(t: Any, y: Any, _: Any) -> Any:
        x, velocity = y
        force = problem.on_site(x, height, jnp.sin)
        around = jnp.concatenate((x[:1], x[:-1])) + jnp.concatenate((x[1:], x[-1:]))
        return velocity, around - 2.0 * x - force - p.eta * velocity

    term, start = diffrax.ODETerm(evaluate_rhs), (jnp.asarray(problem.start), jnp.zeros(p.N))

    def solve_end(y: Any, tolerance: Any) -> Any:
        controller = diffrax.PIDController(rtol=tolerance, atol=tolerance)
        solution = diffrax.diffeqsolve(
            term, diffrax.Dopri8(), 0.0, duration, None, y, stepsize_controller=controller,
            max_steps=None, adjoint=diffrax.ForwardMode(),
        )  # fmt: skip
        return solution.ys[0][-1]

    compiled = jax.jit(solve_end)
    return Peer(SOLVER_TOLERANCES, lambda tolerance: np.asarray(compiled(start, tolerance)))


def _build_mujoco(problem: Problem, duration: float) -> Peer:
    """A slide joint per cell, springs as fixed tendons, the on-site force as applied force.

    MuJoCo has no such potential, so our compiled loop evaluates it before each step, which the
    simulator's symplectic Euler method allows.
    """
    import mujoco

    p, n = problem.design, problem.design.N
    bodies = ''.join(
        f'<body pos="{j} 0 0"><joint name="u{j}" type="slide" axis="1 0 0" damping="{p.eta!r}"/>'
        '<geom type="sphere" size="0.1" mass="1" contype="0" conaffinity="0"/></body>'
        for j in range(n)
    )
    springs = ''.join(
        f'<fixed stiffness="1" springlength="0"><joint joint="u{j}" coef="-1"/>'
        f'<joint joint="u{j + 1}" coef="1"/></fixed>'
        for j in range(n - 1)
    )
    text = (
        '<mujoco><option gravity="0 0 0" integrator="Euler"><flag contact="disable" '
        'eulerdamp="disable"/></option>'
        f'<worldbody>{bodies}</worldbody><tendon>{springs}</tendon></mujoco>'
    )
    model = mujoco.MjModel.from_xml_string(text)
    data, height = mujoco.MjData(model), problem.height

    def solve_problem(dt: float) -> Array:
        mujoco.mj_resetData(model, data)
        steps = round(duration / dt)
        model.opt.timestep = duration / steps
        data.qpos[:] = problem.start
        for _ in range(steps):
            _on_site(data.qpos, height, p.a, p.b, p.c, data.qfrc_applied)
            mujoco.mj_step(model, data)
        return np.array(data.qpos)

    return Peer(tuple(0.25 / 2 ** (0.5 * k) for k in range(9)), solve_problem)


@compile_kernel
def _on_site(u: Array, height: Array, a: float, b: float, c: float, out: Array) -> None:
    for j in range(len(u)):
        slope, sine = on_site_factors((height, a, b), j, u[j] + c)
        out[j] = -slope * sine


PEERS_BY_NAME: dict[str, Callable[[Problem, float], Peer]] = {
    'SciPy DOP853': functools.partial(_build_dop853, _build_compiled_rhs),
    'SciPy DOP853, NumPy': functools.partial(_build_dop853, _build_numpy_rhs),
    'heyoka': _build_heyoka,
    'diffrax Dopri8': _build_diffrax,
    'MuJoCo': _build_mujoco,
}
"""What makes each ready, from the problem and its duration.

They raise `ModuleNotFoundError` where the package is not installed.
"""


TITLE = 'milliseconds at equal error compared with SciPy, heyoka, diffrax and MuJoCo'

PROBLEM_DURATION = 200.0
"""Time units of the problem: the packet has run into the wall."""

REFERENCE_NAME = 'ours, Noh-Bathe'
"""The reference for all others: the paper's method at its step."""


def run(repeats: int) -> list[Comparison]:
    """Measure at the error of our default step and at a hundredth of it."""
    problem = Problem.with_cells(225)
    reference = PEERS_BY_NAME['SciPy DOP853'](problem, PROBLEM_DURATION).solve(1e-13)
    peers, skipped = build_solvers(problem)
    errors = {
        name: [_solution_error(peer.solve(setting), reference) for setting in peer.ladder]
        for name, peer in peers.items()
    }
    default = errors[REFERENCE_NAME][0]
    return [
        _compare_solvers(target, label, peers, errors, skipped, repeats)
        for target, label in ((default, 'default'), (0.01 * default, 'hundredth'))
    ]


def build_solvers(problem: Problem) -> tuple[dict[str, Peer], dict[str, str]]:
    """Return all solvers by name, ours first, and why others do not take part."""
    longest = stable_step(Specimen(problem.design), PEFRL)
    peers = {
        REFERENCE_NAME: Peer(_step_ladder(TIME_STEP), _build_ours(problem, NOH_BATHE)),
        'ours, PEFRL': Peer(_step_ladder(longest), _build_ours(problem, PEFRL)),
        'velocity Verlet': Peer(_step_ladder(TIME_STEP), build_verlet(problem, PROBLEM_DURATION)),
    }
    skipped = {}
    for name, make in PEERS_BY_NAME.items():
        try:
            peers[name] = make(problem, PROBLEM_DURATION)
        except ModuleNotFoundError as error:
            skipped[name] = f'{error.name} is not installed: pip install "mlmem_lab[bench]"'
    return peers, skipped


def _step_ladder(longest: float) -> tuple[float, ...]:
    """Return steps from the longest of which a whole number makes up the duration."""
    first = PROBLEM_DURATION / math.ceil(PROBLEM_DURATION / longest)
    return tuple(first / 2 ** (0.25 * k) for k in range(21))


def _compare_solvers(
    target: float,
    label: str,
    peers: dict[str, Peer],
    errors: dict[str, list[float]],
    skipped: dict[str, str],
    repeats: int,
) -> Comparison:
    contenders, skipped = [], dict(skipped)
    for name, peer in peers.items():
        good = [each for each in zip(peer.ladder, errors[name], strict=True)
                if each[1] <= 1.001 * target]  # fmt: skip
        if not good:
            skipped[name] = f'reached only {min(errors[name]):.1e}'
            continue
        setting, error = good[0]  # ladders begin with the cheapest
        values = {'setting': setting, 'error': error}
        contenders.append(Contender(name, functools.partial(peer.solve, setting), 1.0, values))
    return Comparison(
        f'solvers_{label}',
        f'{PROBLEM_DURATION:g} time units of a wall and a packet, N = 225, error at most '
        f'{target:.1e}',
        'ms',
        'each solver at its cheapest setting within the error, against DOP853 at 1e-13',
        measure_contenders(contenders, repeats, scale=1e3),
        skipped,
    )


def _build_ours(problem: Problem, integrator: Integrator) -> Callable[[float], Array]:
    @functools.cache
    def build_chain(steps: int) -> Chain:
        return problem.chain(dt=PROBLEM_DURATION / steps, integrator=integrator)

    def solve_problem(dt: float) -> Array:
        steps = round(PROBLEM_DURATION / dt)
        build_chain(steps).place(problem.start)
        build_chain(steps).rest(steps)
        return build_chain(steps).v.copy()

    return solve_problem


def _solution_error(solution: Array, reference: Array) -> float:
    error = float(np.abs(solution - reference).max())
    return error if np.isfinite(error) else np.inf
