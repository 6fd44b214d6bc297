# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Ours: walls of both signs in the uniform gradient of Case I: speed, direction, profile."""

from __future__ import annotations

import dataclasses

import numpy as np

from mlmem import simulate
from mlmem.physics import CASE_I, Design
from mlmem.physics.held_wall import hold_walls, make_uniform
from mlmem.physics.values import Array

from ...studies.trace import wall_path
from ..figure import Data, Figure, Judged, Quality, judge_numbers

definition = Figure('gradient', 'A wall in the uniform gradient: speed and profile', seconds=3)


@definition.register_data
def compute_data(quality: Quality) -> Data:
    """Let both kinds of wall go at rest, and return path, speed and change of profile.

    Returns:
        Data with, per wall, `path` and `speed` over `t`, and `profile`, the root-mean-square
        departure over 41 cells from the resting wall of the uniform element at the same place;
        and `path_defect`, that of an anti-kink which meets the defect of Case I.
    """
    duration, every = quality.pick(2600.0, 4200.0), 10.0
    uniform_design = dataclasses.replace(CASE_I, beta=0.0)  # nothing but the gradient
    data: Data = {'eta': np.array(uniform_design.eta), 'gamma': np.array(uniform_design.gamma)}
    flat = make_uniform(uniform_design)
    start_position = 25.0
    for name in ('anti_kink', 'kink'):
        fields = _release_wall(uniform_design, start_position, name, duration, every)
        path = wall_path(uniform_design, fields)
        data['t'] = every * np.arange(1, len(path) + 1)
        data[f'path_{name}'] = path
        data[f'speed_{name}'] = np.gradient(path, data['t'])
        looks = range(0, len(path), quality.pick(40, 10))
        data[f'profile_{name}'] = np.array(
            [_profile_change(flat, fields[i], float(path[i]), name) for i in looks]
        )
    stopped = _release_wall(CASE_I, CASE_I.J - 50.0, 'anti_kink', duration, every)
    return data | {'path_defect': wall_path(CASE_I, stopped), 'defect': np.array(CASE_I.J)}


def _release_wall(
    design: Design, position: float, name: str, duration: float, every: float
) -> Array:
    """Let a wall go at rest; return the configurations, one at the end of every interval."""
    start = _equilibrium_wall(make_uniform(design), position, name)
    run = simulate(
        design, initial=start, duration=duration, save_every=every, progress=False,
    )  # fmt: skip
    return run.configuration[1:]


def _equilibrium_wall(flat: Design, position: float, name: str) -> Array:
    """Return a wall at rest in the uniform element; a kink is a mirrored anti-kink."""
    if name == 'kink':
        return _equilibrium_wall(flat, flat.N + 1 - position, 'anti_kink')[::-1]
    v: Array = hold_walls(flat, np.array([position]), np.zeros(flat.N)).v[0]
    return v


def _profile_change(flat: Design, configuration: np.ndarray, position: float, name: str) -> float:
    near = np.abs(flat.sites - position) <= 20.0
    difference = (configuration - _equilibrium_wall(flat, position, name))[near]
    return float(np.sqrt(np.mean(difference**2)))


def closed_form(data: Data, position: np.ndarray) -> np.ndarray:
    """Return the terminal speed -gamma / (2 eta alpha): gradient force over viscous drag.

    A wall's energy is E sqrt(alpha), its drag eta E sqrt(alpha) times its speed.
    """
    alpha = 1.0 + data['gamma'] * position
    return np.asarray(-data['gamma'] / (2.0 * data['eta'] * alpha))


@definition.register_claim(
    'The (anti-)kink exhibits a permanent profile while travelling the length of the system',
    page=3,
    how='rms departure, over 41 cells about the moving wall, from the resting wall of the '
    'uniform element at the same place (Case I, no defect)',
)
def _permanent_profile(data: Data) -> Judged:
    worst = max(float(data[f'profile_{name}'].max()) for name in ('anti_kink', 'kink'))
    step = 2.0
    return judge_numbers(
        worst < 0.01 * step,
        f'at most {worst:.1e} of a step of {step:g}: {50.0 * worst:.2g} %. It grows with the '
        'distance because alpha falls and the wall widens',
    )


@definition.register_claim(
    'A wall in the uniform gradient propagates to the right with constant speed',
    page=2,
    how='time integration (Case I, no defect), four damping times after release',
)
def _constant_speed(data: Data) -> Judged:
    # time from which the speed is taken: four damping times after the wall was let go
    speed_start_time = 1000.0
    steady = data['t'] > speed_start_time
    speed = np.array([data[f'speed_{name}'][steady] for name in ('anti_kink', 'kink')])
    forecast = closed_form(data, data['path_anti_kink'][steady])
    error = float(np.abs(speed[0] / forecast - 1.0).max())
    spread = float(np.ptp(speed) / speed.mean())
    return judge_numbers(
        bool(speed.min() > 0.0) and spread < 0.1 and error < 0.05,
        f'{speed.mean():.4f} cells per time unit, constant within {100 * spread:.1f} %; the '
        f'closed form -gamma/(2 eta alpha) is met within {100 * error:.1f} %, and explains the '
        'slow rise by the falling alpha',
    )


@definition.register_claim(
    'The gradient supports uni-directional propagation of both kink and anti-kink',
    page=2,
    how='both kinds of wall let go at rest',
)
def _both_kinds(data: Data) -> Judged:
    moved = [float(np.ptp(data[f'path_{name}'])) for name in ('anti_kink', 'kink')]
    right = [bool(np.all(np.diff(data[f'path_{name}'])[5:] > 0)) for name in ('anti_kink', 'kink')]
    return judge_numbers(
        all(right),
        f'both move right only: the anti-kink by {moved[0]:.1f}, the kink by {moved[1]:.1f} '
        f'cells in {data["t"][-1]:.0f} time units',
    )


@definition.register_claim(
    'A wave travels until it enters the well of a soft defect, where dissipation pins it',
    page=2,
    how='Case I with its defect, anti-kink let go at rest 50 cells before it',
)
def _pinned_by_the_defect(data: Data) -> Judged:
    end, defect = float(data['path_defect'][-1]), float(data['defect'])
    passed = float(data['path_defect'].max())
    return judge_numbers(
        abs(end - defect) < 1.0,
        f'it comes to X = {passed:.1f} and rests at {end:.2f}; the defect is at {defect:.0f}',
    )
