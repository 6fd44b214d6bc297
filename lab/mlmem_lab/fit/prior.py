# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What is known of an element before anything was heard.

Gamma, beta and the overall stiffness are patterns of alpha_j that the prior knows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mlmem_ros.physics import Design
from mlmem_ros.physics.potential import Array
from mlmem_tools.twin.unknowns import SHARED, Unknowns

AT_REST = ('D_s1', 'D_s2', 'zero_left', 'zero_right', 'gain_left', 'gain_right')
"""Unknowns that the displacements at rest show."""

IN_TIME = 1e-9
"""Standard deviation of what is known."""


@dataclass(frozen=True)
class Prior:
    """Standard deviations of the unknowns about the design, before anything was heard.

    Attributes:
        scatter: Of alpha from cell to cell, relative.
        stiffness: Of the overall stiffness of the cells, relative.
        gamma: Of the gradient, relative to the design's.
        beta: Of the anomaly of the defects, relative to the design's.
        ground_state: Of either ground state, in lattice constants.
        c: Of the offset of the potential, which decides k_s2 / k_s1, in lattice constants.
        skew: Of the force of a law of its own about its second ground state, relative.
        eta: Of the damping, relative.
        time_unit: Of the time unit, relative.
        substrate_ratio: Of s_max / s_min, relative.
        j_0: Of the site of least substrate stiffness, in cells.
        zero: Of a transducer's zero, in lattice constants.
        gain: Of a transducer's gain, relative, as sensor and as driver.
        late: By which a transducer is late, where that is sought, in time units.
        mass: Of a cell's mass, relative.
        offset: Of a cell's ground states, in lattice constants.
        k_r: Of a spring between cells, relative.
        damping: Of a cell's damping, relative to eta.
        friction: Of a dry friction on every cell, in k_r cells.
    """

    scatter: float = 0.02
    stiffness: float = 0.05
    gamma: float = 0.05
    beta: float = 0.05
    ground_state: float = 0.05
    c: float = 0.7
    skew: float = 0.1
    eta: float = 0.2
    time_unit: float = 0.05
    substrate_ratio: float = 0.05
    j_0: float = 0.5
    zero: float = 0.02
    gain: float = 0.02
    late: float = 0.3
    mass: float = 0.005
    offset: float = 0.01
    k_r: float = 0.005
    damping: float = 0.3
    friction: float = 1e-5

    def precision(self, unknowns: Unknowns) -> Array:
        """Return the inverse of the prior's covariance, shape (size, size).

        Cells scatter independently about the patterns of stiffness, gamma and beta.
        """
        design, alpha = unknowns.design, unknowns.design.alpha
        relative = np.array((self.stiffness, self.gamma, self.beta))
        shared = relative[:, None] * patterns(design)
        spread = np.diag((self.scatter * alpha) ** 2) + shared.T @ shared
        full = np.zeros((unknowns.size, unknowns.size))
        full[unknowns.alpha, unknowns.alpha] = np.linalg.inv(spread)
        deviations = np.array((
            self.ground_state, self.ground_state, self.skew if design.law else self.c,
            self.eta * max(design.eta, 1e-4), self.time_unit,
            self.substrate_ratio * design.s_max / design.s_min, self.j_0,
            *(self.zero,) * 2, *(self.gain,) * 4,
            *(self.late if unknowns.latency else IN_TIME,) * 4,
        ))  # fmt: skip
        places = np.arange(design.N, design.N + len(SHARED))
        full[places, places] = deviations**-2
        for cells, deviation in (
            (unknowns.mass, self.mass), (unknowns.offset, self.offset),
            (unknowns.k_r, self.k_r), (unknowns.damped, self.damping),
        ):  # fmt: skip
            places = np.arange(cells.start, cells.stop)
            full[places, places] = deviation**-2
        if unknowns.friction:
            full[-1, -1] = self.friction**-2
        return full


def patterns(design: Design) -> Array:
    """Return how alpha changes with the relative changes of stiffness, gamma and beta.

    Shape (3, N). Data cannot distinguish these three from cells that happen to follow them.
    """
    alpha, j = design.alpha, design.sites
    defect = (j % design.J == 0) & (j <= design.N - design.tail)
    gradient = design.gamma * j / (1.0 + design.gamma * j)
    anomaly = design.beta / (1.0 + design.beta) * defect
    return np.asarray(alpha * np.array([np.ones(design.N), gradient, anomaly]))


def basis(unknowns: Unknowns, free: str) -> Array:
    """Return a basis of the changes that are free, shape (size, m); see `Stage.free`."""
    if free == 'cells':
        return np.eye(unknowns.size)
    if free == 'rest':
        return np.eye(unknowns.size)[:, [unknowns.shared(name) for name in AT_REST]]
    shared = np.zeros((unknowns.size, 3 + len(SHARED)))
    shared[unknowns.alpha, :3] = patterns(unknowns.design).T
    for k in range(len(SHARED)):
        shared[unknowns.design.N + k, 3 + k] = 1.0
    return shared
