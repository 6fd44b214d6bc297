# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The way to the least misfit: Levenberg and Marquardt's method, and what is sought when."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

from mlmem.physics.values import Array

from .misfit import MAX_MISFIT_PER_DATUM, WHOLE_WINDOW, Misfit, Normal, Slopes, free_basis


@dataclass(frozen=True)
class Stage:
    """A step on the way to the minimum.

    Attributes:
        window: How long after its pulse each shot is compared.
        blur: Least standard deviation of a sample.
        free: What is sought: 'rest', what the displacements at rest show; 'shared', what all cells
            share; 'cells', everything.
        enough: Decrease of the misfit at which it ends, relative.
        least: The same in absolute terms.
    """

    window: float
    blur: float
    free: str = 'cells'
    iterations: int = 6
    enough: float = 0.02
    least: float = 0.0


def minimise_misfit(
    misfit: Misfit, x: Array, stage: Stage, slopes: Slopes | None = None
) -> tuple[Array, float, Slopes | None]:
    """Return the values of least misfit and prior, by Levenberg and Marquardt's method.

    Derivatives take most of the time. They are kept, from stage to stage, as long as they foresee
    by how much the misfit decreases; only those of the same stage tell that its minimum is near,
    unless it is blurred. Two small decreases tell it, too: where a model lacks something, errors
    of the derivatives leave no better way.

    Args:
        slopes: Derivatives taken near x.

    Returns:
        The values, the misfit per datum, and derivatives near them.

    Raises:
        StateError, DesignError: The start makes no element.
    """
    mean, precision = misfit.unknowns.mean, misfit.precision
    free = free_basis(misfit.unknowns, stage.free)
    prior = free.T @ precision @ free

    def total_cost(x: Array, cost: float) -> float:
        return cost + float((x - mean) @ precision @ (x - mean))

    shared, damping, left = stage.free == 'shared', 0.0, stage.iterations
    sure, last = stage.blur > 0.0, np.inf
    near: Normal | None = None
    small_damping = 1e-2  # damping up to which a small decrease means that the minimum is near
    # decrease of a misfit beyond what is allowed that is little: such a model lacks something
    small_decrease = 1e-3
    # error of the decrease that is foreseen up to which derivatives are kept, relative
    max_forecast_error = 0.2
    while left > 0:
        new = slopes is None or slopes.window < stage.window or slopes.shared is not shared
        if new:
            slopes, sure, near = misfit.slopes(x, stage.window, shared), True, None
        normal = near = misfit.normal(x, stage.window, stage.blur, slopes, near)
        now = total_cost(x, normal.cost)
        H, g = (normal.H, normal.g) if shared else (free.T @ normal.H @ free, free.T @ normal.g)
        H, g = H + prior, g + free.T @ precision @ (x - mean)
        scale = 1.0 / np.sqrt(np.diag(H))
        H = scale[:, None] * H * scale
        while True:
            damped = H + damping * np.eye(len(H))
            try:
                np.linalg.cholesky(damped)  # is it positive definite?
            except np.linalg.LinAlgError:
                damping = max(1e-6, 10.0 * damping)
                continue
            step = np.linalg.solve(damped, scale * g)
            moved = x - free @ (scale * step)
            then = total_cost(moved, misfit.cost(moved, stage.window, stage.blur))
            if then < now or damping > 1e6 or not new:
                break
            damping = max(1e-4, 10.0 * damping)
        foreseen = float(step @ (2.0 * scale * g - H @ step))
        beyond = now - MAX_MISFIT_PER_DATUM * normal.data
        enough = max(stage.least, stage.enough * now, small_decrease * beyond)
        if not then < now:
            if new or (sure and damping < small_damping and foreseen < enough):
                return x, now / max(1, normal.data), slopes
            slopes = None
            continue
        x, damping, left = moved, damping / 10.0 if damping > 1e-4 else 0.0, left - 1
        little = now - then < enough and (damping < small_damping or last < enough)
        last = now - then
        if little and sure:
            break
        if little or abs(now - then - foreseen) > max(max_forecast_error * foreseen, enough):
            slopes = None
    return x, then / max(1, normal.data), slopes


class Schedule(Enum):
    """Stages of a fit, in their order; the value is a tuple of `Stage`."""

    BLANK = (
        Stage(WHOLE_WINDOW, 3e-4),
        Stage(WHOLE_WINDOW, 1e-4, iterations=1),
        Stage(WHOLE_WINDOW, 3e-5, iterations=1),
        Stage(WHOLE_WINDOW, 0.0, iterations=20, enough=1e-3),
    )
    """How a blank element alone is fitted at last: it leaves cells open, so that its minimum lies
    at the end of a long valley, and only begins what follows."""

    CELLS = (
        *BLANK[:-1],
        Stage(WHOLE_WINDOW, 0.0, iterations=60, enough=1e-6, least=0.05),
    )
    """How every cell is fitted once the wall is found. A shorter window would leave far cells
    open, and as they wander, the wall may lose its place. Few iterations do for most elements;
    where the wall was at one place only, the minimum lies at the end of a long valley, too."""

    FIRST = (
        Stage(-WHOLE_WINDOW, 0.0, 'rest'),
        *(Stage(window, 2e-4, 'shared') for window in (20.0, 60.0, 120.0, 200.0)),
        *(Stage(window, 3e-4, iterations=3) for window in (60.0, 150.0, 300.0)),
        *BLANK,
    )
    """What all cells share first, on growing windows, so that a clock that is some per cent off
    skips no cycle; then every cell; then all that the noise allows."""

    SLOW = (
        FIRST[0],
        *(
            Stage(window, 2e-4, 'shared', 12, 0.01)
            for window in (10.0, 20.0, 40.0, 80.0, 140.0, 200.0)
        ),
        *(Stage(window, 5e-4, 'cells', 6, 0.01) for window in (20.0, 40.0, 80.0, 160.0, 320.0)),
        *BLANK,
    )
    """For an element on which the first one ends in a local minimum."""
