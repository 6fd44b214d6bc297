# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whether a fit can be trusted: its misfit, its cells beside what chance does, and every shot
beside what the others foretell.
"""

from __future__ import annotations

import math

import numpy as np

from mlmem.physics import DesignError, StateError

from .fitted import MIN_DIVISOR, MIN_EVIDENCE_GAIN, Fit, invert_matrix
from .misfit import MAX_MISFIT_PER_DATUM, WHOLE_WINDOW, alpha_patterns
from .unknowns import SHARED_UNKNOWNS


def list_doubts(found: Fit) -> list[str]:
    """Return why a fit cannot be trusted, in words; nothing if it can."""
    unknowns, precision = found.unknowns, found.misfit.precision
    why = []
    if not found.chi2 <= MAX_MISFIT_PER_DATUM:
        why.append(
            f'the misfit is {found.chi2:.3g} per datum, where {MAX_MISFIT_PER_DATUM:g} is allowed'
        )
    # largest one at the frequencies of the echoes; up to there, intervals are widened
    max_band_misfit = 2.0
    if not found.in_band <= max_band_misfit:
        why.append(
            f'at the frequencies of the echoes the misfit is {found.in_band:.3g} per datum, '
            f'where {max_band_misfit:g} is allowed'
        )
    off = found.x - unknowns.mean
    # largest misfit of the prior per cell: 0.3 in sound fits, 1 where cells scatter as expected
    max_prior_misfit = 2.5
    # largest correlation of neighbouring cells, in standard deviations
    max_neighbour_correlation = 5.0
    for name, where in {'alpha': unknowns.alpha, **unknowns.cells}.items():
        if where.stop == where.start:
            continue
        prior = precision[where, where]
        each = float(off[where] @ prior @ off[where]) / len(prior)
        if each > max_prior_misfit:
            why.append(
                f'{name} would have to scatter {math.sqrt(each):.2g} times as much as expected'
            )
        sure = neighbour_correlation(found, where)
        if abs(sure) > max_neighbour_correlation:
            way = 'alternates from cell to cell' if sure < 0.0 else 'is alike in neighbours'
            why.append(f'{name} {way}, which chance does to one element in millions')
    deviations = 1.0 / np.sqrt(np.diag(precision))
    # farthest that a shared value may be from what is expected, in standard deviations
    max_shared_deviation = 4.5
    why += [
        f'{name} would have to be {found.x[place]:.4g}, {abs(off[place] / deviations[place]):.2g} '
        'standard deviations off what is expected'
        for name, place in ((name, unknowns.shared(name)) for name in SHARED_UNKNOWNS)
        if abs(off[place]) > max_shared_deviation * deviations[place]
    ]
    return why


def neighbour_correlation(found: Fit, where: slice) -> float:
    """Return the correlation of neighbouring cells over what chance makes of it, in s.d.

    It is that of the cells' deviations from the patterns that they may share. What the data leave
    open draws cells to the prior, and errors of neighbours are correlated: both are allowed for.
    """
    prior = invert_matrix(found.misfit.precision[where, where])
    design, n = found.unknowns.design, where.stop - where.start
    scale = design.alpha if where == found.unknowns.alpha else np.ones(n)
    shared = (alpha_patterns(design) / design.alpha).T[:n]
    rest = np.eye(n) - shared @ np.linalg.pinv(shared)
    z = rest @ ((found.x - found.unknowns.mean)[where] / scale)
    spread = (prior - found.covariance[where, where]) / np.multiply.outer(scale, scale)
    spread = rest @ spread @ rest
    beside = 0.5 * (np.eye(n, k=1) + np.eye(n, k=-1)) @ spread
    expected, deviation = np.trace(beside), math.sqrt(2.0 * max(0.0, np.trace(beside @ beside)))
    correlation = float(z[1:] @ z[:-1]) / max(float(z @ z), MIN_DIVISOR)
    return float((correlation * np.trace(spread) - expected) / max(deviation, MIN_DIVISOR))


def needs_term(found: Fit) -> bool:
    """Return whether something may be missing.

    Gains that drift by a thousandth bend what all cells share before they leave a misfit.
    """
    left = found.in_band > found.sound or found.drift_evidence > MIN_EVIDENCE_GAIN
    return left or bool(list_doubts(found))


def held_out(found: Fit) -> tuple[float, ...]:
    """Return the misfit per datum of every shot, predicted from the others.

    Leaving a shot out moves the minimum by a step of Newton's method, and what only this shot
    tells may then be anything that the prior allows: beside the noise, its prediction is off by
    that.
    """
    misfit, x = found.misfit, found.x
    slopes = found.slopes or misfit.slopes(x, WHOLE_WINDOW)
    parts = list(misfit.iterate_normals(x, WHOLE_WINDOW, slopes=slopes))
    H = np.sum([part.H for part in parts], axis=0) + misfit.precision
    told = invert_matrix(H)
    costs = []
    for shot, J, part in zip(misfit.shots, slopes.each, parts, strict=True):
        alone, without = misfit.select_shots([shot]), x + invert_matrix(H - part.H) @ part.g
        try:
            normal = alone.normal(without, WHOLE_WINDOW, slopes=slopes._replace(each=(J,)))
        except (DesignError, StateError):
            costs.append(np.inf)
            continue
        # of a covariance 1 + J inverse(H - part.H) J^T, whose inverse is 1 - J inverse(H) J^T
        costs.append((normal.cost - float(normal.g @ told @ normal.g)) / part.data)
    return tuple(costs)
