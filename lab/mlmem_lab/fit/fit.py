# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The fit: from shots to every cell of an element, with intervals that can be trusted.

Where the wall rested when a shot was fired is found first, by the equilibrium that explains its
waveforms best: a survey drives the wall without a look where it arrives, and cells that scatter
hold it anywhere.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from mlmem.instrument.end import Shot
from mlmem.physics import Design, Integrator, StateError
from mlmem.physics.potential import Array
from mlmem_tools.twin.forward import NEAR, equilibria
from mlmem_tools.twin.unknowns import Unknowns

from .descent import AGAIN, BLANK, LAST, SCHEDULE, SLOWER, Stage, minimise
from .fitted import ADDED, OF_LINE, Fit, posterior, rescaled, widened, with_term
from .misfit import LARGEST, WHOLE, Misfit, Prior, Slopes
from .trusted import asks, doubts, held_out

WINDOW = 300.0
"""Time after a pulse in which its waveforms are compared."""

BLUR = 3e-4
"""Least standard deviation of a sample: the element is not yet known well."""


TRIED = 3
"""Places that are tried for the first wall."""

APART = 2.0
"""Least distance between two of them in cells: a fit moves between nearer ones."""

BEHIND = 4.0
"""Misfit of a wrong place over that of the best."""


def located(misfit: Misfit, x: Array) -> tuple[Misfit, Array]:
    """Return a misfit with the walls where they most probably were, and better values.

    Shots that were fired at the same supposed site saw the same wall. The first wall shows how
    waves travel in the active phase, which a blank element does not tell: so some places, and the
    one nearest to the supposed site, are tried in turn: what all cells share is fitted to each.

    x are values as fitted to the blank element.
    """
    found = {0.0: 0.0}
    for supposed in _walls(misfit):
        same = _with(misfit, supposed)
        places = ranked(misfit, x, same)
        if places and places[0] and not any(found.values()):
            nearest = min(places, key=lambda place: abs(place - supposed))
            tried = dict.fromkeys((nearest, *_apart(places)[:TRIED]))
            guesses = [misfit.only(_with(misfit, 0.0) + _moved(same, place)) for place in tried]
            best, x = _best(guesses, x)
            places = [best.shots[-1].wall]
        found[supposed] = places[0] if places else supposed
    return misfit.only([replace(shot, wall=found[shot.wall]) for shot in misfit.shots]), x


def relocated(misfit: Misfit, x: Array) -> Misfit:
    """Return a misfit with the walls where they were, at most `NEAR` from where they are."""
    found = {0.0: 0.0}
    for known in _walls(misfit):
        places = ranked(misfit, x, _with(misfit, known), known)
        found[known] = places[0] if places else known
    return misfit.only([replace(shot, wall=found[shot.wall]) for shot in misfit.shots])


def _walls(misfit: Misfit) -> list[float]:
    return sorted({shot.wall for shot in misfit.shots if shot.wall})


def _with(misfit: Misfit, wall: float) -> list[Shot]:
    """Return the shots with a wall, or those of the blank element."""
    return [shot for shot in misfit.shots if shot.wall == wall]


def ranked(
    misfit: Misfit, x: Array, shots: Sequence[Shot], near: float | None = None
) -> list[float]:
    """Return where the wall of some shots can have rested, the most probable place first.

    The shots have the same wall; 0 if a survey lost it. `near` takes only places at most `NEAR`
    from there.
    """
    sites, lost = np.arange(2.0, misfit.unknowns.design.N), [0.0]
    if near is not None:
        sites, lost = sites[np.abs(sites - near) <= NEAR], []
    scores = {}
    for place in (*lost, *equilibria(misfit.forward(x), shots[0], sites)):
        try:
            each = (misfit.residuals(x, shot, WINDOW, BLUR)[0] for shot in _moved(shots, place))
            scores[place] = sum(float(np.sum(values**2)) for values in each)
        except StateError:  # held so weakly there that it is not found again
            continue
    return sorted(scores, key=lambda place: scores[place])


def _moved(shots: Sequence[Shot], place: float) -> list[Shot]:
    return [replace(shot, wall=place) for shot in shots]


def _apart(places: Sequence[float]) -> list[float]:
    """Return places that are not close to a better one."""
    kept: list[float] = []
    for place in places:
        if all(abs(place - other) > APART for other in kept):
            kept.append(place)
    return kept


def _best(guesses: Sequence[Misfit], x: Array) -> tuple[Misfit, Array]:
    """Return the best of some guesses, and values with what all cells share fitted to it.

    Those that are far behind on a window are not tried on a longer one.
    """
    tried = [(guess, x, 0.0) for guess in guesses]
    for stage in AGAIN:
        tried = [(guess, *minimise(guess, at, stage)[:2]) for guess, at, _ in tried]
        least = min(cost for *_, cost in tried)
        tried = [each for each in tried if each[2] <= BEHIND * least]
    best, x, _ = min(tried, key=lambda each: each[2])
    return best, x


BESIDE = 0.5
"""Cells from its place at which a wall is at another one; it follows what is fitted by less."""

PREDICTED = 2.0
"""Largest misfit per datum of a shot as the others predict it."""


class Misfitting(Exception):
    """The data cannot be fitted; the message gives the reason."""


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
        shots: Pulses and what both ends did, with every state at rest before.
        integrator: That of a simulated element, whose errors are repeated; None for a real one.

    Raises:
        Misfitting: The data cannot answer, or no model describes the element.
    """
    _check(design, shots)
    told = report or (lambda what, share: None)
    misfit = Misfit(Unknowns(design), shots, prior or Prior(), integrator)
    first = _blank(misfit, told)
    told('where the wall was', 0.0)
    misfit, x = located(first.misfit.only(shots), first.x)
    if not _walls(misfit):
        raise Misfitting('the wall was lost before every shot that was to see one: survey again')
    _, x = _best([misfit], x)
    found = _descend(relocated(misfit, x), x, LAST, told)
    if found.chi2 > LARGEST and not found.missing.term:
        found = _without_worst(found, x, told)
    found = _explained(found, told)
    told('pulses held out', 0.5)
    return _predicted(replace(found, held_out=held_out(found), slopes=None))


def _predicted(found: Fit) -> Fit:
    """Return a fit in which the other shots predict every one.

    Far from the minimum, what all cells share can be bent until all shots agree; leave one out,
    and they do not.
    """
    worst = int(np.argmax(found.held_out))
    if not found.held_out[worst] <= PREDICTED:  # also NaN
        raise Misfitting(
            f'the fit cannot be trusted: the other shots predict shot {worst + 1} with a misfit '
            f'of {found.held_out[worst]:.3g} per datum, where {PREDICTED:g} is allowed; the fit '
            'is far from its minimum: survey again'
        )
    return found


def _without_worst(found: Fit, x: Array, told: Report) -> Fit:
    """Return a better fit, if one wall was sought at a wrong place: it is found once more.

    The others are fitted without it, and tell where it was.
    """
    misfit = found.misfit
    parts = {wall: misfit.only(_with(misfit, wall)) for wall in _walls(misfit)}
    costs = {wall: part.cost(found.x, WHOLE) for wall, part in parts.items()}
    if len(costs) < 2:
        return found
    worst = max(costs, key=lambda wall: costs[wall])
    others = [shot for shot in misfit.shots if shot.wall != worst]
    again = _descend(misfit.only(others), x, LAST, told)
    if again.chi2 > LARGEST:
        return found
    moved = ranked(misfit, again.x, _with(misfit, worst))[:1]
    shots = others + [replace(shot, wall=wall) for wall in moved for shot in _with(misfit, worst)]
    whole = _descend(misfit.only(shots), again.x, LAST, told)
    if whole.chi2 <= LARGEST:
        return whole
    left_out = f'the shots with the wall near {worst:.0f}, which agree with no place of it'
    return replace(again, untold=(*again.untold, left_out))


def _blank(misfit: Misfit, told: Report) -> Fit:
    """Return the fit to the blank element alone, whose state is known.

    It need not describe the element yet, but what is wrong with the line must be known.
    """
    blank = misfit.only(_with(misfit, 0.0))
    found = _descend(blank, misfit.unknowns.mean, SCHEDULE, told)
    while found.chi2 > LARGEST:
        term, why, _ = found.missing
        if term in OF_LINE:
            found = _with_more(found, term, BLANK, told)
            continue
        if not term:  # a local minimum?
            again = _descend(found.misfit, misfit.unknowns.mean, SLOWER, told)
            found = min(found, again, key=lambda each: each.chi2)
        elif term not in ADDED:
            raise Misfitting(
                f'the model does not describe this element: {doubts(found)[0]}; {why}'
            )
        break
    return found


def _explained(found: Fit, told: Report) -> Fit:
    """Return a fit that describes the element, with more unknowns if the data ask for them."""
    while asks(found):
        term, why, _ = found.missing
        if term in ADDED:
            found = _with_more(found, term, LAST, told)
        elif doubt := doubts(found):
            raise Misfitting(
                f'the model does not describe this element: {doubt[0]}{_where(found)}; {why}'
            )
        else:
            break
    return found


def _with_more(found: Fit, term: str, stages: Sequence[Stage], told: Report) -> Fit:
    """Return the fit with one more term, from where it was without: what is missing may have put a
    wall beside its place.
    """
    misfit, slopes = with_term(found.misfit, term), found.missing.slopes
    x = widened(found, misfit.unknowns)
    moved = _moving(misfit, x)
    return _descend(moved, x, stages, told, slopes if moved is misfit else None)


def _moving(misfit: Misfit, x: Array) -> Misfit:
    """Return a misfit with the walls that were beside their places there; the same without any."""
    again = relocated(misfit, x)
    pairs = zip(again.shots, misfit.shots, strict=True)
    return again if any(abs(a.wall - b.wall) > BESIDE for a, b in pairs) else misfit


def _where(found: Fit) -> str:
    """Return in words where most of a misfit is, if it is with one wall."""
    misfit, x, total = found.misfit, found.x, found.chi2 * found.data
    for wall in _walls(misfit):
        if misfit.only(_with(misfit, wall)).cost(x, WHOLE) > 0.8 * total:
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


def _descend(
    misfit: Misfit, x: Array, stages: Sequence[Stage], told: Report, slopes: Slopes | None = None
) -> Fit:
    """Return the fit to which a sequence of stages leads; derivatives near x may be known."""
    for number, stage in enumerate(stages):
        what = _what(misfit.unknowns) if stage.free == 'cells' else 'shared values'
        told(f'{what}, {_window(stage)}', number / len(stages))
        if not stage.blur and stage.window == WHOLE:
            misfit = misfit.drifting(x)
        x, _, slopes = minimise(misfit, x, stage, slopes)
    told('fitted', 1.0)
    scaled = rescaled(misfit, x, slopes)
    if scaled is not misfit:
        x, _, slopes = minimise(scaled, x, stages[-1], slopes)
    return posterior(scaled, x, slopes)


def _what(unknowns: Unknowns) -> str:
    added = [term for term in ADDED if getattr(unknowns, term, False)]
    return ', '.join(('every cell', *added))


def _window(stage: Stage) -> str:
    if stage.window < 0.0:
        return 'displacements at rest'
    return 'whole record' if stage.window == WHOLE else f'{stage.window:g} after the pulse'
