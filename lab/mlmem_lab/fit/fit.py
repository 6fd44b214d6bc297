# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The fit: from shots to every cell of an element, with intervals that can be trusted."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mlmem_ros.device.shot import Shot
from mlmem_ros.physics import Design, Integrator, Specimen
from mlmem_ros.physics.potential import Array
from mlmem_ros.twin.forward import Clock
from mlmem_ros.twin.unknowns import SHARED, Prior, Unknowns

from .locating import SHARED as SHARED_AGAIN
from .locating import located, ranked, relocated
from .misfit import Misfit, Normal, Stage, minimise

WHOLE = 1e9
"""A window as long as the record."""

SCHEDULE = (
    Stage(-WHOLE, 0.0, 'rest'),
    *(Stage(window, 2e-4, 'shared') for window in (20.0, 60.0, 120.0, 200.0)),
    *(Stage(window, 3e-4, iterations=3) for window in (60.0, 150.0, 300.0)),
    Stage(WHOLE, 3e-4, iterations=2),
    Stage(WHOLE, 1e-4, iterations=1),
    Stage(WHOLE, 3e-5, iterations=1),
    Stage(WHOLE, 0.0, iterations=8, enough=0.0, least=0.5),
)
"""What all cells share first, on growing windows, so that a clock that is some per cent off skips
no cycle; then every cell; then all that the noise allows."""

SLOWER = (
    SCHEDULE[0],
    *(
        Stage(window, 2e-4, 'shared', 12, 0.01)
        for window in (10.0, 20.0, 40.0, 80.0, 140.0, 200.0)
    ),
    *(Stage(window, 5e-4, 'cells', 6, 0.01) for window in (20.0, 40.0, 80.0, 160.0, 320.0)),
    *SCHEDULE[-4:],
)
"""For an element on which the first one ends in a local minimum."""

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

LARGEST = 1.1
"""Largest misfit per datum of a model that describes the element."""

FORETOLD = 2.0
"""Largest misfit per datum of a shot as the others foretell it."""

WHITE = 0.3
"""Correlation of residuals from sample to sample below which no motion leaves them: waves last
some samples."""

TOLD = 0.7
"""Fraction of its prior deviation below which the deviation of an unknown counts as told."""


class Misfitting(Exception):
    """The data cannot be fitted; the message gives the reason."""


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


Report = Callable[[str, float], object]
"""Is told what is being fitted, and the fraction done."""


def fit(
    design: Design,
    shots: Sequence[Shot],
    *,
    prior: Prior | None = None,
    integrator: Integrator | None = None,
    report: Report | None = None,
) -> Fit:
    """Return the element that explains shots.

    Masses and then offsets of the cells are unknown only if the shots cannot be explained without.

    Args:
        design: The element as designed.
        shots: Pulses and what both ends did, with every state at rest before.
        prior: What is known beforehand.
        integrator: That of a simulated element, whose errors are repeated; None for a real one.
        report: Is told the progress.

    Raises:
        Misfitting: The data cannot answer, or no model describes the element.
    """
    _check(design, shots)
    told = report or (lambda what, share: None)
    misfit = Misfit(Unknowns(design, prior or Prior()), shots, integrator)
    first = _explained(_blank(misfit, told), told)
    told('where the wall was', 0.0)
    shots, x = located(first.misfit, first.x, shots)
    shared = _descend(first.misfit.only(shots), x, SHARED_AGAIN, told)
    shots = relocated(first.misfit, shared.x, shots)
    found = _descend(first.misfit.only(shots), shared.x, SCHEDULE[-6:], told)
    if found.chi2 > LARGEST:
        found = _without_worst(found, shared.x, told)
    found = _explained(found, told)
    told('pulses held out', 0.5)
    return _foretold(replace(found, held_out=_held_out(found)))


def _foretold(found: Fit) -> Fit:
    """Return a fit in which the other shots foretell every one.

    A wall that is taken to be elsewhere bends what all cells share until all shots agree; leave
    one out, and they do not.

    Raises:
        Misfitting: A shot is not foretold.
    """
    worst = int(np.argmax(found.held_out))
    if not found.held_out[worst] <= FORETOLD:  # also NaN
        raise Misfitting(
            f'the fit is not to be trusted: the others foretell shot {worst + 1} with a misfit '
            f'of {found.held_out[worst]:.3g} per datum, where {FORETOLD:g} is allowed; a wall '
            'may have rested elsewhere than found: survey again'
        )
    return found


def _held_out(found: Fit) -> tuple[float, ...]:
    """Return the misfit per datum of every shot, predicted from the others.

    Leaving a shot out moves the minimum by a step of Newton's method.
    """
    misfit, x, precision = found.misfit, found.x, found.unknowns.precision()
    alone = [misfit.only([shot]) for shot in misfit.shots]
    parts = [each.normal(x, WHOLE) for each in alone]
    H = np.sum([part.H for part in parts], axis=0) + precision
    return tuple(
        each.cost(x + inverse(H - part.H) @ part.g, WHOLE) / part.data
        for each, part in zip(alone, parts, strict=True)
    )


def _without_worst(found: Fit, x: Array, told: Report) -> Fit:
    """Return a better fit, if one wall was sought at a wrong place: it is found once more.

    The others are fitted without it, and tell where it was.
    """
    misfit = found.misfit
    places = {shot.wall for shot in misfit.shots if shot.wall}
    if len(places) < 2:
        return found
    costs = {wall: misfit.only(_with(misfit, wall)).cost(found.x, WHOLE) for wall in places}
    worst = max(costs, key=lambda wall: costs[wall])
    others = [shot for shot in misfit.shots if shot.wall != worst]
    again = _descend(misfit.only(others), x, SCHEDULE[-6:], told)
    if again.chi2 > LARGEST:
        return found
    moved = ranked(misfit, again.x, _with(misfit, worst))[:1]
    shots = others + [replace(shot, wall=wall) for wall in moved for shot in _with(misfit, worst)]
    whole = _descend(misfit.only(shots), again.x, SCHEDULE[-4:], told)
    if whole.chi2 <= LARGEST:
        return whole
    left_out = f'the shots with the wall near {worst:.0f}, which agree with no place of it'
    return replace(again, untold=(*again.untold, left_out))


def _with(misfit: Misfit, wall: float) -> list[Shot]:
    """Return the shots with a wall."""
    return [shot for shot in misfit.shots if shot.wall == wall]


def _blank(misfit: Misfit, told: Report) -> Fit:
    """Return the fit to the blank element alone, whose state is known."""
    blank = misfit.only([shot for shot in misfit.shots if not shot.wall])
    found = _descend(blank, misfit.unknowns.mean, SCHEDULE, told)
    if found.chi2 > LARGEST and not missing_term(found)[0]:  # a local minimum?
        again = _descend(blank, misfit.unknowns.mean, SLOWER, told)
        found = min(found, again, key=lambda each: each.chi2)
    return found


def _explained(found: Fit, told: Report) -> Fit:
    """Return a fit that describes the element, with more unknowns if needed.

    Raises:
        Misfitting: There is none.
    """
    while found.chi2 > LARGEST:
        term, why = missing_term(found)
        if term not in ADDED or getattr(found.unknowns, term):
            raise Misfitting(
                'the model does not describe this element: the misfit is '
                f'{found.chi2:.3g} per datum, where {LARGEST:g} is allowed{_where(found)}; {why}'
            )
        misfit = replace(found.misfit, unknowns=found.unknowns.with_(term))
        found = _descend(misfit, _widened(found, misfit.unknowns), SCHEDULE[-4:], told)
    return found


def _where(found: Fit) -> str:
    """Return in words where most of a misfit is, if it is with one wall."""
    misfit, x, total = found.misfit, found.x, found.chi2 * found.data
    for wall in {shot.wall for shot in misfit.shots}:
        part = misfit.only([shot for shot in misfit.shots if shot.wall == wall])
        if wall and part.cost(x, WHOLE) > 0.8 * total:
            return f', nearly all of it in the shots with the wall near {wall:.0f}'
    return ''


def _check(design: Design, shots: Sequence[Shot]) -> None:
    """Raise `Misfitting` if shots cannot answer, whatever they hold."""
    if not shots:
        raise Misfitting('there are no shots to fit')
    if design.substrate != 'rigid':
        raise Misfitting('only an element with a rigid substrate can be fitted')
    heard = {shot.end for shot in shots}
    if len(heard) < 2:
        raise Misfitting(f'shots from both ends are needed; all came from the {heard.pop()} end')
    if not any(shot.wall for shot in shots):
        raise Misfitting('shots with a wall are needed: a blank element shows one phase only')
    for shot in shots:
        if not 0 <= shot.wall <= design.N:
            raise Misfitting(f'a shot has its wall at {shot.wall}, beyond {design.N} cells')
        if not np.isfinite(shot.rest).all():
            raise Misfitting('the displacements at rest before every shot are needed')
    if all(shot.wall for shot in shots):
        raise Misfitting('shots of the blank element are needed, to begin with')
    heard_share = np.mean([np.isfinite(shot.samples).mean() for shot in shots])
    if heard_share < 0.5:
        raise Misfitting(f'only {heard_share:.0%} of the samples are there; half are needed')


def _descend(misfit: Misfit, x: Array, stages: Sequence[Stage], told: Report) -> Fit:
    """Return the fit to which a sequence of stages leads."""
    for number, stage in enumerate(stages):
        what = _what(misfit.unknowns) if stage.free == 'cells' else 'shared values'
        told(f'{what}, {_window(stage)}', number / len(stages))
        if stage is SCHEDULE[-1]:
            misfit = misfit.drifting(x)
        x, _ = minimise(misfit, x, stage, misfit.unknowns.precision())
    told('fitted', 1.0)
    return _posterior(misfit, x)


def _what(unknowns: Unknowns) -> str:
    cells = 'every cell'
    if unknowns.masses:
        cells += ' with its mass'
    return f'{cells} and offset' if unknowns.offsets else cells


def _window(stage: Stage) -> str:
    if stage.window < 0.0:
        return 'displacements at rest'
    return 'whole record' if stage.window == WHOLE else f'{stage.window:g} after the pulse'


def _posterior(misfit: Misfit, x: Array) -> Fit:
    """Return the fit with its posterior at a minimum."""
    normal, precision = misfit.normal(x, WHOLE), misfit.unknowns.precision()
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


def missing_term(own: Fit) -> tuple[str, str]:
    """Return which missing term would lower the misfit most: a key of `TERMS`, and in words.

    Each term is added to the linearised model, with its prior. The key is empty if none helps.
    """
    misfit = own.misfit
    full = misfit.unknowns.with_(*TERMS)
    at = _widened(own, full)
    normal, precision = replace(misfit, unknowns=full).normal(at, WHOLE), full.precision()
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


def _widened(found: Fit, unknowns: Unknowns) -> Array:
    """Return the values of a fit among more unknowns, the new ones as designed."""
    x, end = unknowns.mean, unknowns.shared_end
    x[:end] = found.x[:end]
    for cells in ('mass', 'offset'):
        if (own := getattr(found.unknowns, cells)).stop > own.start:
            x[getattr(unknowns, cells)] = found.x[own]
    return x
