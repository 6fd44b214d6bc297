# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The misfit between shots and their prediction, and its minimum."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from mlmem_ros.device.shot import Shot
from mlmem_ros.physics import DesignError, Integrator, StateError
from mlmem_ros.physics.potential import Array
from mlmem_tools.twin.forward import Clock, Forward
from mlmem_tools.twin.noise import about_zero, noise
from mlmem_tools.twin.unknowns import Unknowns

from .prior import AT_REST, Prior

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
        loosened: What gains that may drift take from the logarithm of the evidence, twice.
    """

    H: Array
    g: Array
    cost: float
    data: int
    loosened: float = 0.0


@dataclass(frozen=True, eq=False)
class Misfit:
    """Shots, and what is to be found from them.

    Attributes:
        unknowns: What is unknown.
        shots: The shots.
        prior: What is known beforehand.
        integrator: That of a simulated element, whose errors are repeated; None for a real one.
        drift: Standard deviation of a transducer's zero from shot to shot.
        gain_drift: Standard deviation of its gain from shot to shot, relative.
    """

    unknowns: Unknowns
    shots: Sequence[Shot]
    prior: Prior = field(default_factory=Prior)
    integrator: Integrator | None = None
    drift: float = DRIFT
    gain_drift: float = 0.0

    @cached_property
    def _noise(self) -> dict[int, tuple[Array, Array]]:
        return {}

    @cached_property
    def precision(self) -> Array:
        """The inverse of the prior's covariance, shape (size, size)."""
        return self.prior.precision(self.unknowns)

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
        residual = weights * about_zero(misfit, weights)
        return self._loosened(residual, predicted, weights)[0], weights

    def _loosened(self, values: Array, predicted: Array, weights: Array) -> tuple[Array, float]:
        """Return whitened values, (2, m, ...), where the gain of either end may be another one.

        To integrate over a gain takes most of the direction of the prediction out of them. The
        second number is twice what that costs in the logarithm of the evidence.
        """
        if not self.gain_drift:
            return values, 0.0
        cost, heard = 0.0, weights * about_zero(predicted + 0.0, weights)
        for u, of_end in zip(heard, values, strict=True):
            power = float(u @ u)
            wide = 1.0 + self.gain_drift**2 * power
            of_end -= (1.0 - wide**-0.5) / power * np.multiply.outer(u, u @ of_end)
            cost += float(np.log(wide))
        return values, cost

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
        H, g, cost, data, loosened = np.zeros((m, m)), np.zeros(m), 0.0, 0, 0.0
        forward = self.forward(x)
        for shot in self.shots:
            predicted, J = forward.linearised(shot, shot.pulse.duration + window)
            residual, weights = self.residuals(shot, predicted, blur)
            about = about_zero(J.astype(np.float64), weights[..., None])
            whitened, loose = self._loosened(weights[..., None] * about, predicted, weights)
            flat = whitened.reshape(-1, m)
            H += flat.T @ flat
            g += flat.T @ residual.ravel()
            cost += float(np.sum(residual**2))
            data += int(np.count_nonzero(weights))
            loosened += loose
        return Normal(H, g, cost, data, loosened)
