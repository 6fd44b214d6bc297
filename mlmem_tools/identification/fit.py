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
from mlmem.physics import Design
from mlmem.physics.values import Array

from .descent import Schedule, Stage, minimise_misfit
from .fitted import ADDED_TERMS, Fit, compute_posterior, rescale_scatter, widen_unknowns, with_term
from .forward import find_equilibria
from .misfit import MAX_MISFIT_PER_DATUM, PRIOR_DEVIATIONS, WHOLE_WINDOW, Misfit, Slopes
from .trusted import held_out, list_doubts, needs_term
from .unknowns import Unknowns


def locate_walls(misfit: Misfit, x: Array) -> tuple[Misfit, Array]:
    """Return a misfit with the walls where they most probably were, and better values.

    Shots that were fired at the same supposed site saw the same wall. The first wall shows how
    waves travel in the active phase, which a blank element does not tell: so some places, and the
    one nearest to the supposed site, are tried in turn: what all cells share is fitted to each.

    x are values as fitted to the blank element.
    """
    found = {0.0: 0.0}
    max_tried_places = 3  # places that are tried for the first wall
    for supposed in _list_walls(misfit):
        same = _shots_with_wall(misfit, supposed)
        places = rank_places(misfit, x, same)
        if places and places[0] and not any(found.values()):
            nearest = min(places, key=lambda place: abs(place - supposed))
            tried = dict.fromkeys((nearest, *_drop_close_places(places)[:max_tried_places]))
            guesses = [
                misfit.select_shots(_shots_with_wall(misfit, 0.0) + _move_walls(same, place))
                for place in tried
            ]
            best, x = _choose_best(guesses, x)
            places = [best.shots[-1].wall]
        found[supposed] = places[0] if places else supposed
    return misfit.select_shots([replace(shot, wall=found[shot.wall]) for shot in misfit.shots]), x


def relocate_walls(misfit: Misfit, x: Array) -> Misfit:
    """Return a misfit with the walls where they were, at most `forward.MAX_WALL_OFFSET_CELLS` from
    where they are.
    """
    found = {0.0: 0.0}
    for known in _list_walls(misfit):
        places = rank_places(misfit, x, _shots_with_wall(misfit, known), known)
        found[known] = places[0] if places else known
    return misfit.select_shots([replace(shot, wall=found[shot.wall]) for shot in misfit.shots])


def _list_walls(misfit: Misfit) -> list[float]:
    return sorted({shot.wall for shot in misfit.shots if shot.wall})


def _shots_with_wall(misfit: Misfit, wall: float) -> list[Shot]:
    """Return the shots with a wall, or those of the blank element."""
    return [shot for shot in misfit.shots if shot.wall == wall]


def rank_places(
    misfit: Misfit, x: Array, shots: Sequence[Shot], near: float | None = None
) -> list[float]:
    """Return where the wall of some shots can have rested, the most probable place first.

    The shots have the same wall; 0 if a survey lost it. `near` takes only places at most
    `forward.MAX_WALL_OFFSET_CELLS` from there.
    """
    waveform_window = 300.0  # time after a pulse in which its waveforms are compared
    # least standard deviation of a sample: the element is not yet known well
    min_sample_deviation = 3e-4
    lost = [0.0] if near is None else []
    scores = {
        place: misfit.cost(x, waveform_window, min_sample_deviation, _move_walls(shots, place))
        for place in (*lost, *find_equilibria(misfit.forward(x), shots[0], near))
    }
    # infinite: held so weakly there that it is not found again
    return sorted((each for each in scores if scores[each] < np.inf), key=scores.__getitem__)


def _move_walls(shots: Sequence[Shot], place: float) -> list[Shot]:
    return [replace(shot, wall=place) for shot in shots]


def _drop_close_places(places: Sequence[float]) -> list[float]:
    """Return places that are not close to a better one."""
    kept: list[float] = []
    # least distance between two of them in cells: a fit moves between nearer ones
    min_place_distance = 2.0
    for place in places:
        if all(abs(place - other) > min_place_distance for other in kept):
            kept.append(place)
    return kept


def _choose_best(guesses: Sequence[Misfit], x: Array) -> tuple[Misfit, Array]:
    """Return the best of some guesses, and values with what all cells share fitted to it.

    Those that are far behind on a window are not tried on a longer one.
    """
    tried = [(guess, x, 0.0) for guess in guesses]
    wrong_place_ratio = 4.0  # misfit of a wrong place over that of the best
    for window in (20.0, 60.0, 200.0):
        stage = Stage(window, 2e-4, 'shared')
        tried = [(guess, *minimise_misfit(guess, at, stage)[:2]) for guess, at, _ in tried]
        least = min(cost for *_, cost in tried)
        tried = [each for each in tried if each[2] <= wrong_place_ratio * least]
    best, x, _ = min(tried, key=lambda each: each[2])
    return best, x


class Misfitting(Exception):
    """The data cannot be fitted; the message gives the reason."""


Report = Callable[[str, float], object]
"""Is told what is being fitted, and the fraction done."""


def fit_element(
    design: Design,
    shots: Sequence[Shot],
    *,
    scatter: float = PRIOR_DEVIATIONS['scatter'],
    simulated: bool = False,
    report: Report | None = None,
) -> Fit:
    """Return the element that explains shots.

    Masses and then offsets of the cells are unknown only if the shots cannot be explained without.

    Args:
        shots: Pulses and what both ends did, with every state at rest before.
        scatter: Standard deviation of alpha from cell to cell that is expected, relative.
        simulated: Whether the element is simulated, so that its steps are repeated.

    Raises:
        Misfitting: The data cannot answer, or no model describes the element.
    """
    _check_shots(design, shots)
    told = report or (lambda what, share: None)
    misfit = Misfit(Unknowns(design), shots, PRIOR_DEVIATIONS | {'scatter': scatter}, simulated)
    first = _fit_blank(misfit, told)
    told('where the wall was', 0.0)
    misfit, x = locate_walls(first.misfit.select_shots(shots), first.x)
    if not _list_walls(misfit):
        raise Misfitting('the wall was lost before every shot that was to see one: survey again')
    _, x = _choose_best([misfit], x)
    found = _descend_stages(relocate_walls(misfit, x), x, Schedule.CELLS, told)
    if found.chi2 > MAX_MISFIT_PER_DATUM and not found.missing.term:
        found = _without_worst(found, x, told)
    found = _extend_model(found, told)
    told('pulses held out', 0.5)
    return _predict_shots(replace(found, held_out=held_out(found), slopes=None))


def _predict_shots(found: Fit) -> Fit:
    """Return a fit in which the other shots predict every one.

    Far from the minimum, what all cells share can be bent until all shots agree; leave one out,
    and they do not.
    """
    worst = int(np.argmax(found.held_out))
    max_predicted_misfit = 2.0  # largest misfit per datum of a shot as the others predict it
    if not found.held_out[worst] <= max_predicted_misfit:  # also NaN
        raise Misfitting(
            f'the fit cannot be trusted: the other shots predict shot {worst + 1} with a misfit '
            f'of {found.held_out[worst]:.3g} per datum, where {max_predicted_misfit:g} is '
            f'allowed; the fit '
            'is far from its minimum: survey again'
        )
    return found


def _without_worst(found: Fit, x: Array, told: Report) -> Fit:
    """Return a better fit, if one wall was sought at a wrong place: it is found once more.

    The others are fitted without it, and tell where it was.
    """
    misfit = found.misfit
    costs = {
        wall: misfit.cost(found.x, WHOLE_WINDOW, shots=_shots_with_wall(misfit, wall))
        for wall in _list_walls(misfit)
    }
    if len(costs) < 2:
        return found
    worst = max(costs, key=lambda wall: costs[wall])
    others = [shot for shot in misfit.shots if shot.wall != worst]
    again = _descend_stages(misfit.select_shots(others), x, Schedule.CELLS, told)
    if again.chi2 > MAX_MISFIT_PER_DATUM:
        return found
    moved = rank_places(misfit, again.x, _shots_with_wall(misfit, worst))[:1]
    shots = others + [
        replace(shot, wall=wall) for wall in moved for shot in _shots_with_wall(misfit, worst)
    ]
    whole = _descend_stages(misfit.select_shots(shots), again.x, Schedule.CELLS, told)
    if whole.chi2 <= MAX_MISFIT_PER_DATUM:
        return whole
    left_out = f'the shots with the wall near {worst:.0f}, which agree with no place of it'
    return replace(again, undetermined=(*again.undetermined, left_out))


def _fit_blank(misfit: Misfit, told: Report) -> Fit:
    """Return the fit to the blank element alone, whose state is known.

    It need not describe the element yet, but what is wrong with the line must be known.
    """
    blank = misfit.select_shots(_shots_with_wall(misfit, 0.0))
    found = _descend_stages(blank, misfit.unknowns.mean, Schedule.FIRST, told)
    while found.chi2 > MAX_MISFIT_PER_DATUM:
        term, why, _ = found.missing
        # they are of the transducers and their line: a blank element tells them
        if term in ('latency', 'drift'):
            found = _fit_with_term(found, term, Schedule.BLANK, told)
            continue
        if not term:  # a local minimum?
            again = _descend_stages(found.misfit, misfit.unknowns.mean, Schedule.SLOW, told)
            found = min(found, again, key=lambda each: each.chi2)
        elif term not in ADDED_TERMS:
            raise Misfitting(
                f'the model does not describe this element: {list_doubts(found)[0]}; {why}'
            )
        break
    return found


def _extend_model(found: Fit, told: Report) -> Fit:
    """Return a fit that describes the element, with more unknowns if the data ask for them."""
    while needs_term(found):
        term, why, _ = found.missing
        if term in ADDED_TERMS:
            found = _fit_with_term(found, term, Schedule.CELLS, told)
        elif doubt := list_doubts(found):
            raise Misfitting(
                f'the model does not describe this element: '
                f'{doubt[0]}{_describe_misfit_place(found)}; {why}'
            )
        else:
            break
    return found


def _fit_with_term(found: Fit, term: str, schedule: Schedule, told: Report) -> Fit:
    """Return the fit with one more term, from where it was without: what is missing may have put a
    wall beside its place.
    """
    misfit, slopes = with_term(found.misfit, term), found.missing.slopes
    x = widen_unknowns(found, misfit.unknowns)
    moved = _move_strayed_walls(misfit, x)
    return _descend_stages(moved, x, schedule, told, slopes if moved is misfit else None)


def _move_strayed_walls(misfit: Misfit, x: Array) -> Misfit:
    """Return a misfit with the walls that were beside their places there; the same without any."""
    again = relocate_walls(misfit, x)
    pairs = zip(again.shots, misfit.shots, strict=True)
    # cells from its place at which a wall is at another one; it follows what is fitted by less
    max_wall_shift = 0.5
    return again if any(abs(a.wall - b.wall) > max_wall_shift for a, b in pairs) else misfit


def _describe_misfit_place(found: Fit) -> str:
    """Return in words where most of a misfit is, if it is with one wall."""
    misfit, x, total = found.misfit, found.x, found.chi2 * found.data
    for wall in _list_walls(misfit):
        if misfit.cost(x, WHOLE_WINDOW, shots=_shots_with_wall(misfit, wall)) > 0.8 * total:
            return f', nearly all of it in the shots with the wall near {wall:.0f}'
    return ''


def _check_shots(design: Design, shots: Sequence[Shot]) -> None:
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


def _descend_stages(
    misfit: Misfit, x: Array, schedule: Schedule, told: Report, slopes: Slopes | None = None
) -> Fit:
    """Return the fit to which a schedule leads; derivatives near x may be known."""
    stages: tuple[Stage, ...] = schedule.value
    for number, stage in enumerate(stages):
        told(f'stage {number + 1} of {len(stages)}', number / len(stages))
        if not stage.blur and stage.window == WHOLE_WINDOW:
            misfit = misfit.with_drift(x)
        x, _, slopes = minimise_misfit(misfit, x, stage, slopes)
    told('fitted', 1.0)
    scaled = rescale_scatter(misfit, x, slopes)
    if scaled is not misfit:
        x, _, slopes = minimise_misfit(scaled, x, stages[-1], slopes)
    return compute_posterior(scaled, x, slopes)
