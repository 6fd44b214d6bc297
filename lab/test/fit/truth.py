# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Hidden elements, and their shots by classical Runge-Kutta steps."""

from dataclasses import dataclass, replace

import numpy as np

from mlmem.element_file import Element
from mlmem.instrument.end import End, Pulse, Shot
from mlmem.physics import Design, HeldCell, Specimen
from mlmem.physics.equilibrium import relax_to_equilibrium
from mlmem.settings import ProbeSettings
from mlmem_lab.rk4 import Rk4Element

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
class Truth:
    """A hidden element, and the instrument around it."""

    specimen: Specimen
    time_unit: float
    friction: float
    zero = 0.003, -0.002
    gain = 1.01, 0.99

    @property
    def design(self):
        """The design that it has, other than the one that the fit is told."""
        return self.specimen.design

    @property
    def strength(self):
        """alpha_j in units of the nominal d."""
        return self.specimen.alpha * self.design.d / SMALL.d


def hidden(seed, mass=0.0, friction=0.0, **shared):
    """Return an element whose alpha scatters by 1 % and whose shared values are off by 2 %."""
    random = np.random.default_rng(seed)

    def about(value):
        return value * (1.0 + 0.02 * random.uniform(-1.0, 1.0))

    made = replace(SMALL, **{
        'd': about(SMALL.d), 'a': about(SMALL.a), 'eta': about(SMALL.eta),
        's_max': about(SMALL.s_max), 'j_0': SMALL.j_0 + 0.2 * random.uniform(-1.0, 1.0),
    } | shared)  # fmt: skip
    specimen = Specimen(
        made,
        alpha_factor=1.0 + 0.01 * random.standard_normal(made.N),
        mass=1.0 + mass * random.standard_normal(made.N),
    )
    return Truth(specimen, about(1.0), friction)


def settle(element, level, strain):
    """Put the wall of an element at a level, or none, and let it rest under a strain."""
    made = element.specimen
    design = made.design
    wall = -5.0 if level < 0 else design.defect_site(level) + 0.3
    mean, half = (design.D_s1 + design.D_s2) / 2, (design.D_s2 - design.D_s1) / 2
    element.V_N = design.end_displacement(strain)
    V = element.V_N * made.strain_shape
    element.v = relax_to_equilibrium(
        made, V + mean - half * np.tanh((design.sites - wall) / 2.8), V
    )
    element.velocity = np.zeros(design.N)


def measured(truth, shots=SHOTS, *, dt=0.3, duration=120.0, parts=4, held_off=0.0):
    """Return the shots of a hidden element; `held_off`, of one or each of them, is by how much the
    driven end is held from where it rests.
    """
    random, found, A = np.random.default_rng(0), [], 0.01
    zero, gain = np.array(truth.zero)[:, None], np.array(truth.gain)[:, None]
    body = Element(truth.specimen, np.zeros(SMALL.N), time_unit=truth.time_unit).timed_specimen
    samples = round(duration / dt)
    off = np.broadcast_to(held_off, len(shots))
    for (end, carrier, sigma, level, strain), aside in zip(shots, off, strict=True):
        element = Rk4Element(body, dt, step=dt / parts, friction=truth.friction)
        settle(element, level, strain)
        rest = element.v[[0, -1]]
        site, row = (1, 0) if end is End.LEFT else (SMALL.N, 1)
        pulse = Pulse(rest[row], ProbeSettings(A=A, omega_c=carrier, sigma=sigma))
        times = dt * np.arange(1, samples + 1)
        motion = pulse.evaluate_motion(times[times <= 12.0 * sigma + 1e-9])
        motion[0] = rest[row] + (motion[0] - rest[row]) / truth.gain[row] + aside
        motion[1] /= truth.gain[row]
        ends = element.advance(np.full(samples, element.V_N), HeldCell(site, motion))
        read = zero + gain * ends
        read += 1e-5 * random.standard_normal(read.shape)
        wall = 0 if level < 0 else SMALL.defect_site(level)
        before = (zero + gain * rest[:, None])[:, 0]
        found.append(Shot(end, carrier, A, sigma, wall, strain, dt, before, read))
    return found
