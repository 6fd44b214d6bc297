# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An element as fitted: the most probable values, how sure they are, what is not told,
and what a model lacks that does not describe it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mlmem.physics import Specimen
from mlmem.physics.values import Array

from .misfit import (
    MAX_MISFIT_PER_DATUM,
    WHOLE_WINDOW,
    ZERO_DRIFT_CELLS,
    Misfit,
    Normal,
    Slopes,
    prior_precision,
)
from .noise import estimate_noise
from .unknowns import CELL_TERMS, SHARED_UNKNOWNS, Unknowns

MIN_DIVISOR = 1e-300
"""Keeps quotients finite."""


@dataclass(frozen=True, eq=False)
class Fit:
    """An element as fitted.

    Attributes:
        x: The most probable values, shape (size,).
        covariance: Of their posterior distribution, shape (size, size).
        chi2: Misfit per datum.
        in_band: Misfit per datum at the frequencies of the echoes: 1 if noise alone is left. There
            an error of the model is, whatever the rest of what is sampled looks like.
        sound: What that is at most if the model lacks nothing.
        held_out: Misfit per datum of every shot as the others predict it, in their order.
        slopes: Derivatives of the shots near these values, as long as more is asked of them.
    """

    misfit: Misfit
    x: Array
    covariance: Array
    chi2: float
    data: int
    in_band: float = 1.0
    sound: float = 1.2
    undetermined: tuple[str, ...] = ()
    held_out: tuple[float, ...] = ()
    slopes: Slopes | None = None

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
        noise = [estimate_noise(shot) for shot in self.misfit.shots]
        return float(np.sqrt(np.mean(np.square(noise))))

    @cached_property
    def drift_evidence(self) -> float:
        """By how much gains that drift would raise twice the logarithm of the evidence."""
        if has_term(self.misfit, 'drift'):
            return 0.0
        x, every = self.x, np.ones(self.unknowns.size, bool)
        loose, before = (
            _log_evidence(each, each.normal(x, WHOLE_WINDOW, slopes=self.slopes), x, every)
            for each in (with_term(self.misfit, 'drift'), self.misfit)
        )
        return loose - before

    @cached_property
    def missing(self) -> Missing:
        """Which term its model lacks most; see `missing_term`."""
        return missing_term(self)

    @property
    def added_terms(self) -> list[str]:
        """The terms that the data asked for, of `ADDED_TERMS`."""
        return [term for term in ADDED_TERMS if has_term(self.misfit, term)]

    @property
    def deviations(self) -> Array:
        """Standard deviations of the unknowns, shape (size,)."""
        return np.sqrt(np.diag(self.covariance))


def compute_posterior(misfit: Misfit, x: Array, slopes: Slopes | None = None) -> Fit:
    """Return the fit with its posterior at a minimum, near which derivatives may be known."""
    if slopes is None or slopes.window < WHOLE_WINDOW or slopes.shared:
        slopes = misfit.slopes(x, WHOLE_WINDOW)
    normal, precision = misfit.normal(x, WHOLE_WINDOW, slopes=slopes), misfit.precision
    in_band, sound = _band_misfit(misfit, x, slopes, normal.H + precision)
    covariance = invert_matrix(normal.H + precision) * max(1.0, in_band)
    undetermined = _describe_undetermined(misfit, x, np.diag(covariance))
    chi2 = normal.cost / normal.data
    return Fit(
        misfit, x, covariance, chi2, normal.data, in_band, sound, undetermined, slopes=slopes
    )


def rescale_scatter(misfit: Misfit, x: Array, slopes: Slopes | None) -> Misfit:
    """Return a misfit with the scatter of the cells that the data show, near its minimum at x.

    Nobody knows by how much springs or masses differ before they are fitted, and a prior that is
    too wide leaves noise in them. The mean variance is the values' squares over the number of them
    that the data tell (MacKay, Neural Computation 4, 415, 1992), less two, since it is uncertain
    itself; at most what is expected, as if they tell few.
    """
    unknowns, prior = misfit.unknowns, misfit.prior
    own = {term: where for term, where in unknowns.cells.items() if term in unknowns.terms}
    if not own:
        return misfit
    normal, off = misfit.normal(x, WHOLE_WINDOW, slopes=slopes), x - unknowns.mean
    scatter = {name: prior[name] for name in own}
    scatter_rounds = 10  # in which such a deviation settles: each leaves an eighth of its error
    least_scatter = 0.01  # least one that is believed, over what was expected
    for _ in range(scatter_rounds):
        precision = prior_precision(unknowns, {**prior, **scatter})
        covariance = invert_matrix(normal.H + precision)
        best = off - covariance @ (normal.g + precision @ off)
        for name, where in own.items():
            most, left = prior[name], np.trace(covariance[where, where])
            told = where.stop - where.start - left / scatter[name] ** 2 - 2.0
            shown = float(best[where] @ best[where]) / told if told > 0.0 else most**2
            scatter[name] = min(max(math.sqrt(shown), least_scatter * most), most)
    return replace(misfit, scatter=scatter)


def _band_misfit(misfit: Misfit, x: Array, slopes: Slopes, H: Array) -> tuple[float, float]:
    """Return the misfit per datum, weighted with the power of the echoes at each frequency, and
    what it is at most if noise alone is left; no more than 1.2 is believed.

    Intervals must be as wide as the noise at these frequencies says. A fit of precision H takes
    some of that.
    """
    # misfit per datum from which a missing term is sought, however uncertain it is
    max_sound_misfit = 1.2
    both = power = expected = variance = 0.0
    scale = 1.0 / np.sqrt(np.diag(H))
    root = np.linalg.inv(np.linalg.cholesky(scale[:, None] * H * scale))
    spread = (scale[:, None] * root.T).astype(np.float32)
    every = misfit.linearise_shots(x, WHOLE_WINDOW, slopes=slopes)
    for shot, (found, own) in zip(misfit.shots, every, strict=True):
        predicted = misfit.predict_shot(x, shot, WHOLE_WINDOW)
        heard = misfit.whiten_residuals(shot, predicted, found.weights)
        left, echo, taken = (
            np.abs(np.fft.rfft(each[:, 1:], axis=1)) ** 2 / each.shape[1]
            for each in (found.values, heard, own @ spread)
        )
        free = echo * (1.0 - taken.sum(axis=-1))
        both += float(np.sum(left * echo))
        power += float(np.sum(echo))
        expected += float(np.sum(free))
        variance += float(np.sum(free**2))
    if not power:
        return 1.0, max_sound_misfit
    min_band_deviations = 3.0  # the same in standard deviations above what noise leaves of it
    sound = (expected + min_band_deviations * math.sqrt(variance)) / power
    return both / power, min(max_sound_misfit, sound)


def invert_matrix(matrix: Array) -> Array:
    """Return the inverse of a positive definite matrix of any scaling."""
    scale = 1.0 / np.sqrt(np.diag(matrix))
    return np.asarray(scale[:, None] * np.linalg.inv(scale[:, None] * matrix * scale) * scale)


def _describe_undetermined(misfit: Misfit, x: Array, variance: Array) -> tuple[str, ...]:
    """Return what the data cannot tell, from the variance of the unknowns in the posterior."""
    unknowns, before = misfit.unknowns, np.diag(invert_matrix(misfit.precision))
    remaining = np.sqrt(variance) / np.sqrt(before)
    words = [
        'gamma, beta and the overall stiffness from alpha: only alpha_j d acts; '
        "they are held at the design's values"
    ]
    # fraction of its prior deviation below which the deviation of an unknown counts as told
    max_deviation_ratio = 0.7
    if silent := [
        str(j + 1) for j in np.flatnonzero(remaining[unknowns.alpha] > max_deviation_ratio)
    ]:
        words.append(f'alpha of cells {", ".join(silent)}')
    max_known_variance = 1e-12  # variance below which a value is known beforehand
    words += [
        f'{name}: {x[place]:.4g} is mostly the prior'
        for name, place in ((name, unknowns.shared(name)) for name in SHARED_UNKNOWNS)
        if remaining[place] > max_deviation_ratio and before[place] > max_known_variance
    ]
    return tuple(words)


TERM_DESCRIPTIONS = {
    'latency': 'transducers that are late',
    'drift': 'gains that drift from shot to shot',
    'masses': 'masses that differ from cell to cell',
    'offsets': 'ground states that differ from cell to cell',
    'springs': 'springs between the cells that differ',
    'damping': 'damping that differs from cell to cell',
    'friction': 'dry friction',
}
"""What a model may lack."""

ADDED_TERMS = ('latency', 'drift', *CELL_TERMS)
"""Those that can be added to it."""

MIN_EVIDENCE_GAIN = 10.0
"""Least gain of twice the logarithm of the evidence for which a term is added."""


def has_term(misfit: Misfit, term: str) -> bool:
    """Return whether a term, a key of `TERM_DESCRIPTIONS`, is part of a model."""
    return misfit.gain_drift > 0.0 if term == 'drift' else term in misfit.unknowns.terms


def with_term(misfit: Misfit, term: str) -> Misfit:
    """Return a model with one more term."""
    # standard deviation of a gain from shot to shot, where it is taken to drift
    gain_drift = 0.005
    if term == 'drift':
        return replace(misfit, gain_drift=gain_drift, drift=ZERO_DRIFT_CELLS)
    unknowns = replace(misfit.unknowns, terms=misfit.unknowns.terms | {term})
    return replace(misfit, unknowns=unknowns)


class Missing(NamedTuple):
    """Which missing term the data ask for most.

    Attributes:
        term: A key of `TERM_DESCRIPTIONS`, empty if none helps.
        why: The same in words.
        slopes: Derivatives of the model that has it, where the fit is.
    """

    term: str
    why: str
    slopes: Slopes | None = None


def missing_term(own: Fit) -> Missing:
    """Return which missing term the data ask for most.

    Each term is added to the linearised model, with its prior, and the evidence compared: what it
    lowers the misfit, less what it costs to have more unknowns. Drift is tried first, which takes
    no more derivatives.
    """
    gain = {} if has_term(own.misfit, 'drift') else {'drift': own.drift_evidence}
    # up to the largest misfit that is allowed, noise may be that much louder than it was measured
    explained = own.chi2 <= MAX_MISFIT_PER_DATUM
    beyond = 0.0 if explained else (own.chi2 - 1.0) * own.data
    fuller, slopes = own.misfit, own.slopes
    # part of the misfit beyond noise from which a term explains it, so that no other is tried
    fully_explained_part = 0.9
    if explained or max(gain.values(), default=0.0) <= fully_explained_part * beyond:
        gains, fuller, slopes = _evidence_gains(own)
        gain |= gains
    term = max(gain, key=gain.__getitem__)
    min_explained_part = 0.2  # least part of the misfit beyond noise that a missing term explains
    if not gain[term] > max(MIN_EVIDENCE_GAIN, min_explained_part * beyond):
        return Missing(
            '',
            f'nothing that was tried explains it ({", ".join(TERM_DESCRIPTIONS)}): were '
            'levels, strains and sample times as recorded, and was the element at rest before '
            'every shot?',
        )
    share = min(1.0, gain[term] / beyond) if beyond else 1.0
    sought = with_term(own.misfit, term).unknowns
    return Missing(
        term, f'{TERM_DESCRIPTIONS[term]} would explain {share:.0%} of it',
        slopes and slopes.select_unknowns(_locate_unknowns(sought, fuller.unknowns)),
    )  # fmt: skip


def _evidence_gains(own: Fit) -> tuple[dict[str, float], Misfit, Slopes]:
    """Return by how much each term that a fit lacks, other than drift, raises twice the logarithm
    of the evidence; a misfit that has them all, and its derivatives.
    """
    fuller = own.misfit
    lacking = [
        term for term in TERM_DESCRIPTIONS if term != 'drift' and not has_term(fuller, term)
    ]
    for term in lacking:
        fuller = with_term(fuller, term)
    full = fuller.unknowns
    places = {
        **full.cells, 'friction': slice(full.size - 1, None),
        'latency': slice(full.shared('late_left'), full.shared('lag_right') + 1),
    }  # fmt: skip
    known = np.ones(full.size, bool)
    for term in lacking:
        known[places[term]] = False
    at = widen_unknowns(own, full)
    slopes = fuller.slopes(at, WHOLE_WINDOW)
    normal = fuller.normal(at, WHOLE_WINDOW, slopes=slopes)
    before, gain = _log_evidence(fuller, normal, at, known), dict[str, float]()
    for term in lacking:
        free = known.copy()
        free[places[term]] = True
        gain[term] = _log_evidence(fuller, normal, at, free) - before
    return gain, fuller, slopes


def _log_evidence(misfit: Misfit, normal: Normal, x: Array, free: NDArray[np.bool_]) -> float:
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


def widen_unknowns(found: Fit, unknowns: Unknowns) -> Array:
    """Return the values of a fit among more unknowns, the new ones as designed."""
    x = unknowns.mean
    x[_locate_unknowns(found.unknowns, unknowns)] = found.x
    return x


def _locate_unknowns(some: Unknowns, more: Unknowns) -> NDArray[np.int64]:
    """Return where some unknowns are among more, shape (size of some,)."""
    places = [np.arange(more.shared_end)]
    for term, own in some.cells.items():
        start = more.cells[term].start
        places.append(np.arange(start, start + own.stop - own.start))
    return np.concatenate(places)
