# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The misfit between shots and their prediction, and its minimum."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from mlmem_ros.device.shot import Shot
from mlmem_ros.physics import DesignError, Integrator, StateError
from mlmem_ros.physics.potential import Array
from mlmem_ros.twin.forward import Clock, Forward
from mlmem_ros.twin.noise import about_zero, noise
from mlmem_ros.twin.unknowns import AT_REST, Unknowns

DRIFT = 1e-4
"""Standard deviation of a transducer's zero from shot to shot in cells, as long as it is not
known."""

LEAST_DRIFT = 1e-5
"""Least one that is believed."""


@dataclass(frozen=True, eq=False)
class Normal:
    """The normal equations of a linearised misfit.

    Attributes:
        H: J^T J with the residuals in standard deviations, shape (m, m).
        g: J^T r, shape (m,).
        cost: r^T r.
        data: Number of residuals.
    """

    H: Array
    g: Array
    cost: float
    data: int


@dataclass(frozen=True, eq=False)
class Misfit:
    """Shots, and what is to be found from them.

    Attributes:
        unknowns: What is unknown.
        shots: The shots.
        integrator: That of a simulated element, whose errors are repeated; None for a real one.
        drift: Standard deviation of a transducer's zero from shot to shot.
    """

    unknowns: Unknowns
    shots: Sequence[Shot]
    integrator: Integrator | None = None
    drift: float = DRIFT

    @cached_property
    def _noise(self) -> dict[int, tuple[Array, Array]]:
        return {}

    def noise(self, shot: Shot) -> Array:
        """Return the standard deviation of a sample of either end, shape (2,), measured once."""
        if (key := id(shot.samples)) not in self._noise:
            self._noise[key] = shot.samples, noise(shot)  # kept, so that the address stays theirs
        return self._noise[key][1]

    def forward(self, x: Array) -> Forward:
        """Return the forward model with these values; raises as `Forward` does."""
        return Forward(self.unknowns, x, self.integrator)

    def residuals(self, shot: Shot, predicted: Array, blur: float = 0.0) -> tuple[Array, Array]:
        """Return residuals in standard deviations, and their weights, shape (2, m) each.

        Args:
            shot: What was measured.
            predicted: What was predicted, shape (2, m): at rest, then sample by sample.
            blur: Standard deviation of a sample if it is larger than the noise: residuals of a
                model that is still far off are smoothed so.
        """
        stride = Clock.of(shot.dt, self.integrator).stride
        measured = shot.samples[:, stride - 1 :: stride][:, : predicted.shape[1] - 1]
        measured = np.concatenate((shot.rest[:, None], measured), axis=1)
        spread = np.maximum(self.noise(shot), blur)[:, None] * np.ones_like(measured)
        spread[:, 0] = self.drift
        weights = np.where(np.isfinite(measured), 1.0 / spread, 0.0)
        misfit = np.where(weights > 0.0, predicted - measured, 0.0)
        return weights * about_zero(misfit, weights), weights

    def drifting(self, x: Array) -> Misfit:
        """Return this misfit with the drift that the displacements at rest show."""
        forward = self.forward(x)
        each = [forward.predict(shot, 0.0)[:, 0] - shot.rest for shot in self.shots]
        free = max(1, 2 * len(each) - len(AT_REST))
        found = float(np.sqrt(np.sum(np.square(each)) / free))
        return replace(self, drift=min(max(found, LEAST_DRIFT), DRIFT))

    def only(self, shots: Sequence[Shot]) -> Misfit:
        """Return the misfit of other shots."""
        return replace(self, shots=tuple(shots))

    def cost(self, x: Array, window: float, blur: float = 0.0) -> float:
        """Return r^T r over a window after the pulses; infinite where there is no such element."""
        try:
            forward = self.forward(x)
            each = (
                self.residuals(shot, forward.predict(shot, shot.pulse.duration + window), blur)[0]
                for shot in self.shots
            )
            return float(sum(np.sum(residual**2) for residual in each))
        except (DesignError, StateError):
            return np.inf

    def normal(self, x: Array, window: float, blur: float = 0.0) -> Normal:
        """Return the normal equations; raises as `Forward.linearised` does."""
        m = self.unknowns.size
        H, g, cost, data = np.zeros((m, m)), np.zeros(m), 0.0, 0
        forward = self.forward(x)
        for shot in self.shots:
            predicted, J = forward.linearised(shot, shot.pulse.duration + window)
            residual, weights = self.residuals(shot, predicted, blur)
            about = about_zero(J.astype(np.float64), weights[..., None])
            flat = (weights[..., None] * about).reshape(-1, m)
            H += flat.T @ flat
            g += flat.T @ residual.ravel()
            cost += float(np.sum(residual**2))
            data += int(np.count_nonzero(weights))
        return Normal(H, g, cost, data)


FEW = 1e-2
"""Damping up to which a small decrease means that the minimum is near."""


@dataclass(frozen=True)
class Stage:
    """A step on the way to the minimum.

    Attributes:
        window: How long after its pulse each shot is compared.
        blur: Least standard deviation of a sample.
        free: What is sought: 'rest', what the displacements at rest show; 'shared', what all cells
            share; 'cells', everything.
        iterations: Most iterations.
        enough: Decrease of the misfit at which it ends, relative.
        least: The same in absolute terms.
    """

    window: float
    blur: float
    free: str = 'cells'
    iterations: int = 6
    enough: float = 0.02
    least: float = 0.0


def minimise(
    misfit: Misfit,
    x: Array,
    stage: Stage,
    precision: Array,
    report: Callable[[Stage, float], object] | None = None,
) -> tuple[Array, float]:
    """Return the values of least misfit and prior, by Levenberg and Marquardt's method.

    Args:
        misfit: What to minimise.
        x: Where to start.
        stage: How.
        precision: Of the prior about the design, shape (m, m).
        report: Called after every iteration with the misfit per datum.

    Raises:
        StateError, DesignError: The start makes no element.
    """
    mean = misfit.unknowns.mean
    basis = misfit.unknowns.basis(stage.free)
    prior = basis.T @ precision @ basis

    def total(x: Array, cost: float) -> float:
        return cost + float((x - mean) @ precision @ (x - mean))

    damping = 0.0
    for _ in range(stage.iterations):
        normal = misfit.normal(x, stage.window, stage.blur)
        now = total(x, normal.cost)
        H = basis.T @ normal.H @ basis + prior
        g = basis.T @ (normal.g + precision @ (x - mean))
        scale = 1.0 / np.sqrt(np.diag(H))
        H = scale[:, None] * H * scale
        while True:
            try:
                factor = cho_factor(H + damping * np.eye(len(H)))
            except LinAlgError:
                damping = max(1e-6, 10.0 * damping)
                continue
            moved = x - basis @ (scale * cho_solve(factor, scale * g))
            then = total(moved, misfit.cost(moved, stage.window, stage.blur))
            if then < now or damping > 1e6:
                break
            damping = max(1e-4, 10.0 * damping)
        if not then < now:
            return x, now / max(1, normal.data)
        x, damping = moved, damping / 10.0 if damping > 1e-4 else 0.0
        if report is not None:
            report(stage, then / max(1, normal.data))
        if damping < FEW and now - then < max(stage.least, stage.enough * now):
            break
    return x, then / max(1, normal.data)
