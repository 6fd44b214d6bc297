# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a model lacks that does not describe its element."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mlmem_ros.physics.potential import Array
from mlmem_tools.twin.forward import Clock
from mlmem_tools.twin.unknowns import Unknowns

from .descent import WHOLE
from .fitted import LARGEST, Fit, doubts
from .misfit import DRIFT, Misfit, Normal

TERMS = {
    'latency': 'transducers that are late',
    'drift': 'gains that drift from shot to shot',
    'masses': 'masses that differ from cell to cell',
    'offsets': 'ground states that differ from cell to cell',
    'springs': 'springs between the cells that differ',
    'damping': 'damping that differs from cell to cell',
    'friction': 'dry friction',
}
"""What a model may lack."""

OF_LINE = ('latency', 'drift')
"""Those that are of the transducers and their line: a blank element tells them."""

ADDED = (*OF_LINE, 'masses', 'offsets', 'springs', 'damping')
"""Those that can be added to it."""

GAIN_DRIFT = 0.005
"""Standard deviation of a gain from shot to shot, where it is taken to drift."""

ASKS = 1.2
"""Misfit per datum at the frequencies of the echoes from which a missing term is sought."""

HELPS = 0.2
"""Least part of the misfit beyond noise that a missing term explains."""

SURE = 10.0
"""Least gain of twice the logarithm of the evidence for which a term is added."""

WHITE = 0.3
"""Correlation from sample to sample of what residuals have beyond noise, below which no motion
leaves them: waves last some samples."""


def asks(found: Fit) -> bool:
    """Return whether something may be missing."""
    return found.in_band > ASKS or bool(doubts(found))


def has(misfit: Misfit, term: str) -> bool:
    """Return whether a term, a key of `TERMS`, is part of a model."""
    return misfit.gain_drift > 0.0 if term == 'drift' else bool(getattr(misfit.unknowns, term))


def with_term(misfit: Misfit, term: str) -> Misfit:
    """Return a model with one more term."""
    if term == 'drift':
        return replace(misfit, gain_drift=GAIN_DRIFT, drift=DRIFT)
    added: dict[str, Any] = {term: True}
    return replace(misfit, unknowns=replace(misfit.unknowns, **added))


def missing_term(own: Fit) -> tuple[str, str]:
    """Return which missing term the data ask for most: a key of `TERMS`, and in words.

    Each term is added to the linearised model, with its prior, and the evidence compared: what it
    lowers the misfit, less what it costs to have more unknowns. The key is empty if none helps.
    """
    misfit, lacking = own.misfit, [term for term in TERMS if not has(own.misfit, term)]
    fuller = misfit
    for term in lacking:
        fuller = with_term(fuller, term) if term != 'drift' else fuller
    full = fuller.unknowns
    places = {
        'masses': full.mass, 'offsets': full.offset, 'springs': full.k_r,
        'damping': full.damped, 'friction': slice(full.size - 1, None),
        'latency': slice(full.shared('late_left'), full.shared('lag_right') + 1),
    }  # fmt: skip
    known = np.ones(full.size, bool)
    for term in lacking:
        if term != 'drift':
            known[places[term]] = False
    at = widened(own, full)
    normal = fuller.normal(at, WHOLE)
    before, gain = _evidence(fuller, normal, at, known), {}
    for term in lacking:
        if term == 'drift':
            loose = with_term(misfit, term)
            all_of_them = np.ones(loose.unknowns.size, bool)
            whole = loose.normal(own.x, WHOLE, slopes=own.slopes)
            gain[term] = _evidence(loose, whole, own.x, all_of_them) - before
            continue
        free = known.copy()
        free[places[term]] = True
        gain[term] = _evidence(fuller, normal, at, free) - before
    term = max(gain, key=lambda each: gain[each], default='')
    beyond = max(0.0, normal.cost - normal.data)
    helps = term and gain[term] > max(SURE, HELPS * beyond)
    if not helps and own.chi2 > LARGEST and (late := jitter(own)):
        return '', (
            'what is left differs from sample to sample, more where the ends are faster: samples '
            f'whose times jitter by {late:.0%} of a sample would explain it'
        )
    if not helps:
        return '', (
            f'nothing that was tried explains it ({", ".join(TERMS)}): were the levels and '
            'strains as recorded, and was the element at rest before every shot?'
        )
    share = min(1.0, gain[term] / beyond) if beyond else 1.0
    return term, f'{TERMS[term]} would explain {share:.0%} of it'


def _evidence(misfit: Misfit, normal: Normal, x: Array, free: NDArray[np.bool_]) -> float:
    """Return twice the logarithm of the evidence of a linearised model, but for a constant.

    `free` says which unknowns it has; the others are where the prior has them.
    """
    each = np.ix_(free, free)
    off, precision = (x - misfit.unknowns.mean)[free], misfit.precision[each]
    g = normal.g[free] + precision @ off
    H = normal.H[each] + precision
    scale = 1.0 / np.sqrt(np.diag(H))
    scaled = scale[:, None] * H * scale
    lowered = (scale * g) @ np.linalg.solve(scaled, scale * g)
    # the logarithm of det(H) / det(precision), with the same scale
    wide = np.linalg.slogdet(scaled)[1]
    wide -= np.linalg.slogdet(scale[:, None] * precision * scale)[1]
    return float(lowered - normal.cost - normal.loosened - off @ precision @ off - wide)


def jitter(found: Fit) -> float:
    """Return the jitter of the samples' times that would explain a misfit, in samples.

    It is 0 if the residuals are correlated, as those of a wrong model are.
    """
    forward, misfit = found.misfit.forward(found.x), found.misfit
    along = beyond = slopes = 0.0
    for shot in misfit.shots:
        predicted = forward.predict(shot, WHOLE)
        residual, weights = misfit.residuals(forward, shot, predicted)
        r, slope = residual[:, 1:], (weights * np.gradient(predicted, axis=1))[:, 1:]
        along += float(np.sum(r[:, 1:] * r[:, :-1]))
        beyond += float(np.sum(r**2 - (weights[:, 1:] > 0.0)))
        slopes += float(np.sum(slope**2))
    if beyond <= 0.0 or abs(along) > WHITE * beyond:
        return 0.0
    stride = Clock.of(misfit.shots[0].dt, misfit.integrator).stride
    return stride * float(np.sqrt(beyond / slopes))


def widened(found: Fit, unknowns: Unknowns) -> Array:
    """Return the values of a fit among more unknowns, the new ones as designed."""
    x, end = unknowns.mean, unknowns.shared_end
    x[:end] = found.x[:end]
    for cells in ('mass', 'offset', 'k_r', 'damped'):
        if (own := getattr(found.unknowns, cells)).stop > own.start:
            x[getattr(unknowns, cells)] = found.x[own]
    return x
