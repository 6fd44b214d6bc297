# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a model lacks that does not describe its element."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from mlmem_ros.physics.potential import Array
from mlmem_tools.twin.forward import Clock
from mlmem_tools.twin.unknowns import Unknowns

from .descent import WHOLE
from .fitted import Fit, inverse

TERMS = {
    'masses': 'masses that differ from cell to cell',
    'offsets': 'ground states that differ from cell to cell',
    'friction': 'dry friction',
}
"""What a model may lack."""

ADDED = ('masses', 'offsets')
"""Those that can be added to it."""

HELPS = 0.2
"""Least part of the misfit that a missing term explains."""

WHITE = 0.3
"""Correlation of residuals from sample to sample below which no motion leaves them: waves last
some samples."""


def with_terms(unknowns: Unknowns, *terms: str) -> Unknowns:
    """Return unknowns with more of them, by keys of `TERMS`."""
    added: dict[str, Any] = dict.fromkeys(terms, True)
    return replace(unknowns, **added)


def missing_term(own: Fit) -> tuple[str, str]:
    """Return which missing term would lower the misfit most: a key of `TERMS`, and in words.

    Each term is added to the linearised model, with its prior. The key is empty if none helps.
    """
    misfit = own.misfit
    full = with_terms(misfit.unknowns, *TERMS)
    at = widened(own, full)
    fuller = replace(misfit, unknowns=full)
    normal, precision = fuller.normal(at, WHOLE), fuller.precision
    g = normal.g + precision @ (at - full.mean)
    known = np.zeros(full.size, bool)
    known[: misfit.unknowns.shared_end] = True
    places = {'masses': full.mass, 'offsets': full.offset, 'friction': slice(full.size - 1, None)}

    def gain(term: str) -> float:
        free = known.copy()
        for each in filter(None, (term, *(add for add in ADDED if getattr(own.unknowns, add)))):
            free[places[each]] = True
        H = (normal.H + precision)[np.ix_(free, free)]
        return float(g[free] @ inverse(H) @ g[free])

    gains = {term: gain(term) - gain('') for term in TERMS}
    term = max(gains, key=lambda each: gains[each])
    share = gains[term] / normal.cost
    if share < HELPS and (late := jitter(own)):
        return '', (
            'what is left differs from sample to sample, more where the ends are faster: samples '
            f'whose times jitter by {late:.0%} of a sample would explain it'
        )
    if share < HELPS:
        return '', (
            'neither masses nor ground states nor friction would explain it: were the levels and '
            'strains as recorded, and was the element at rest before every shot?'
        )
    return term, f'{TERMS[term]} would explain {share:.0%} of it'


def jitter(found: Fit) -> float:
    """Return the jitter of the samples' times that would explain a misfit, in samples.

    It is 0 if the residuals are correlated, as those of a wrong model are.
    """
    forward, misfit = found.misfit.forward(found.x), found.misfit
    power = along = beyond = slopes = 0.0
    for shot in misfit.shots:
        predicted = forward.predict(shot, WHOLE)
        residual, weights = misfit.residuals(shot, predicted)
        r, slope = residual[:, 1:], (weights * np.gradient(predicted, axis=1))[:, 1:]
        power += float(np.sum(r**2))
        along += float(np.sum(r[:, 1:] * r[:, :-1]))
        beyond += float(np.sum(r**2 - (weights[:, 1:] > 0.0)))
        slopes += float(np.sum(slope**2))
    if abs(along) > WHITE * power or beyond <= 0.0:
        return 0.0
    stride = Clock.of(misfit.shots[0].dt, misfit.integrator).stride
    return stride * float(np.sqrt(beyond / slopes))


def widened(found: Fit, unknowns: Unknowns) -> Array:
    """Return the values of a fit among more unknowns, the new ones as designed."""
    x, end = unknowns.mean, unknowns.shared_end
    x[:end] = found.x[:end]
    for cells in ('mass', 'offset'):
        if (own := getattr(found.unknowns, cells)).stop > own.start:
            x[getattr(unknowns, cells)] = found.x[own]
    return x
