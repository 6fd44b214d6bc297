# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Hidden elements, and their shots by other means: Eq. (1a) written out, and RK4."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import solveh_banded

from mlmem.instrument.end import End, Shot
from mlmem.physics import Design

SMALL = Design(N=36, gamma=-3e-5, beta=-1 / 20, J=9, J_s=18, j_0=6.84, d=0.0380, tail=9)
"""Two levels of nine cells."""

SHOTS = (
    (End.LEFT, 1.2, 3.0, -1, 0.0),
    (End.RIGHT, 0.95, 4.0, -1, 0.0),
    (End.RIGHT, 1.1, 3.0, -1, 0.009),
    (End.RIGHT, 1.1, 3.0, -1, -0.009),
    (End.LEFT, 1.5, 3.0, 1, 0.0),
    (End.RIGHT, 1.0, 3.0, 1, 0.0),
    (End.LEFT, 1.5, 4.0, 0, 0.0),
)
"""End, carrier, sigma, level and strain."""


@dataclass
class Element:
    """A hidden element, and the instrument around it."""

    design: Design  # with its own potential, damping and substrate
    alpha: np.ndarray
    mass: np.ndarray
    k_r: np.ndarray
    time_unit: float = 1.0
    zero: tuple[float, float] = (0.003, -0.002)
    gain: tuple[float, float] = (1.01, 0.99)
    noise: float = 1e-5
    friction: float = 0.0

    @property
    def strength(self):
        """alpha_j in units of the nominal d."""
        return self.alpha * self.design.d / SMALL.d


def hidden(seed, design=SMALL, scatter=0.01, off=0.02, mass=0.0, k_r=0.0, **others):
    """Return an element whose cells scatter and whose shared values are off by up to `off`."""
    random = np.random.default_rng(seed)

    def about(value):
        return value * (1.0 + off * random.uniform(-1.0, 1.0))

    made = replace(
        design, d=about(design.d), a=about(design.a), eta=about(design.eta),
        s_max=about(design.s_max), j_0=design.j_0 + 10.0 * off * random.uniform(-1.0, 1.0),
    )  # fmt: skip
    alpha = design.alpha * (1.0 + scatter * random.standard_normal(design.N))
    masses = 1.0 + mass * random.standard_normal(design.N)
    springs = 1.0 + k_r * np.random.default_rng([seed, 1]).standard_normal(design.N - 1)
    return Element(made, alpha, masses, springs, about(1.0), **others)


def substrate(design, strain):
    """Return V_j of Eq. (2)'s springs in series."""
    j = np.arange(1, design.N)
    half = design.J_s / 2
    rise = np.abs((j - design.j_0 - half) % design.J_s - half) / half
    compliance = 1.0 / (design.s_min + (design.s_max - design.s_min) * rise)
    return strain * design.N * np.concatenate(([0.0], np.cumsum(compliance))) / compliance.sum()


def force(element, v, V):
    """Return -dU/dv_j, shape (..., N)."""
    p = element.design
    y = v - V + p.c
    theta = p.a * y + p.b * y**3
    f = -element.alpha * p.d * np.sin(theta) * (p.a + 3.0 * p.b * y**2)
    stretch = element.k_r * np.diff(v, axis=-1)
    f[..., :-1] += stretch
    f[..., 1:] -= stretch
    return f


def at_rest(element, level, V):
    """Return the equilibrium by Newton's method."""
    p = element.design
    wall = -5.0 if level < 0 else p.defect_site(level) + 0.3
    j = np.arange(1, p.N + 1)
    mean, half = (p.D_s1 + p.D_s2) / 2, (p.D_s2 - p.D_s1) / 2
    v = V + mean - half * np.tanh((j - wall) / 2.8)
    k = np.concatenate(([0.0], element.k_r, [0.0]))
    for _ in range(60):
        f = force(element, v, V)
        bands = np.stack((-k[:-1], k[:-1] + k[1:]))
        y = v - V + p.c
        theta, slope = p.a * y + p.b * y**3, p.a + 3.0 * p.b * y**2
        bands[1] += (
            element.alpha * p.d * (np.cos(theta) * slope**2 + np.sin(theta) * 6.0 * p.b * y)
        )
        shift = 0.0
        while True:
            try:
                step = solveh_banded(bands + np.array([[0.0], [shift]]), f)
                break
            except np.linalg.LinAlgError:
                shift = 4.0 * shift if shift else 0.01
        v = v + step * min(1.0, 0.2 / np.abs(step).max())
        if np.abs(step).max() < 1e-13:
            return v
    raise AssertionError('the hidden element has no such equilibrium')


def measured(
    element, shots=SHOTS, *, dt=0.3, duration=120.0, parts=4, A=0.01, held_off=0.0, seed=0
):
    """Return the shots of a hidden element, all of them run at once; `held_off`, of one or each
    of them, is by how much the driven end is held from where it rests.
    """
    random = np.random.default_rng(seed)
    p, unit = element.design, element.time_unit
    V = np.array([substrate(p, strain) for *_, strain in shots])
    v = np.array(
        [at_rest(element, level, each) for (*_, level, _), each in zip(shots, V, strict=True)]
    )
    rest, u = v.copy(), np.zeros_like(v)
    site = np.array([0 if end is End.LEFT else p.N - 1 for end, *_ in shots])
    carrier, sigma = np.array([(c, s) for _, c, s, *_ in shots]).T
    rows, gain = np.arange(len(shots)), np.array(element.gain)
    scale = A / gain[[0 if end is End.LEFT else 1 for end, *_ in shots]]

    def driven(t):
        x = (t - 6.0 * sigma) / sigma
        envelope = scale * np.exp(-0.5 * x * x)
        wave, slope = np.sin(carrier * t), carrier * np.cos(carrier * t)
        return envelope * wave, envelope * (slope - x / sigma * wave) / unit

    off = np.broadcast_to(held_off, len(shots))

    def held(t, v, u):
        on = t <= 12.0 * sigma + 1e-9
        if not on.any():
            return v, u
        place, speed = driven(t)
        v[rows[on], site[on]] = rest[rows[on], site[on]] + place[on] + off[on]
        u[rows[on], site[on]] = speed[on]
        return v, u

    def rates(t, v, u):
        v, u = held(t, v.copy(), u.copy())
        rub = element.friction * np.tanh(u / 1e-7) if element.friction else 0.0
        return unit * u, unit * (force(element, v, V) - p.eta * u - rub) / element.mass

    h, samples = dt / parts, round(duration / dt)
    ends = np.empty((len(shots), 2, samples))
    for k in range(samples * parts):
        t = k * h
        a1, b1 = rates(t, v, u)
        a2, b2 = rates(t + h / 2, v + h / 2 * a1, u + h / 2 * b1)
        a3, b3 = rates(t + h / 2, v + h / 2 * a2, u + h / 2 * b2)
        a4, b4 = rates(t + h, v + h * a3, u + h * b3)
        v = v + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
        u = u + h / 6 * (b1 + 2 * b2 + 2 * b3 + b4)
        v, u = held(t + h, v, u)
        if (k + 1) % parts == 0:
            ends[:, :, k // parts] = v[:, [0, -1]]
    read = np.array(element.zero)[:, None] + gain[:, None] * ends
    read = read + element.noise * random.standard_normal(read.shape)
    before = np.array(element.zero) + gain * rest[:, [0, -1]]
    return [
        Shot(
            end, c, A, s, 0 if level < 0 else p.defect_site(level), strain, dt, before[i], read[i]
        )
        for i, (end, c, s, level, strain) in enumerate(shots)
    ]
