# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An element as fitted: the most probable values, how sure they are, and what is not told."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from mlmem_ros.physics import Specimen
from mlmem_ros.physics.potential import Array
from mlmem_tools.twin.unknowns import SHARED, Unknowns

from .descent import WHOLE
from .misfit import Misfit, Normal

TOLD = 0.7
"""Fraction of its prior deviation below which the deviation of an unknown counts as told."""


@dataclass(frozen=True, eq=False)
class Fit:
    """An element as fitted.

    Attributes:
        misfit: What was minimised: unknowns and shots.
        x: The most probable values, shape (size,).
        covariance: Of their posterior distribution, shape (size, size).
        chi2: Misfit per datum.
        data: Number of data.
        untold: What the data cannot tell, in words.
        held_out: Misfit per datum of every shot as the others predict it, in their order.
    """

    misfit: Misfit
    x: Array
    covariance: Array
    chi2: float
    data: int
    untold: tuple[str, ...] = ()
    held_out: tuple[float, ...] = ()

    @property
    def unknowns(self) -> Unknowns:
        """What was sought."""
        return self.misfit.unknowns

    @property
    def specimen(self) -> Specimen:
        """The most probable element."""
        return self.unknowns.specimen(self.x)

    @property
    def noise(self) -> float:
        """Root mean square noise of a sample in cells."""
        noise = [self.misfit.noise(shot) for shot in self.misfit.shots]
        return float(np.sqrt(np.mean(np.square(noise))))

    @property
    def deviations(self) -> Array:
        """Standard deviations of the unknowns, shape (size,)."""
        return np.sqrt(np.diag(self.covariance))


def posterior(misfit: Misfit, x: Array) -> Fit:
    """Return the fit with its posterior at a minimum."""
    normal, precision = misfit.normal(x, WHOLE), misfit.precision
    covariance = inverse(normal.H + precision)
    found = Fit(misfit, x, covariance, normal.cost / normal.data, normal.data)
    return replace(found, untold=tuple(_untold(found, normal, inverse(precision))))


def inverse(matrix: Array) -> Array:
    """Return the inverse of a positive definite matrix of any scaling."""
    scale = 1.0 / np.sqrt(np.diag(matrix))
    return np.asarray(scale[:, None] * np.linalg.inv(scale[:, None] * matrix * scale) * scale)


def _untold(found: Fit, normal: Normal, before: Array) -> list[str]:
    """Return what the data cannot tell."""
    unknowns = found.unknowns
    remaining = found.deviations / np.sqrt(np.diag(before))
    words = [
        'gamma, beta and the overall stiffness from alpha: only alpha_j d acts; '
        "they are held at the design's values"
    ]
    if silent := [str(j + 1) for j in np.flatnonzero(remaining[unknowns.alpha] > TOLD)]:
        words.append(f'alpha of cells {", ".join(silent)}')
    words += [
        f'{name}: {found.x[unknowns.shared(name)]:.4g} is mostly the prior'
        for name in SHARED
        if remaining[unknowns.shared(name)] > TOLD
    ]
    return words
