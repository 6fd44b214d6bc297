# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Claims about writing and erasing (Figs. 4a and 5, pages 5 and 6)."""

from __future__ import annotations

import numpy as np

from ...physics import CASE_II
from ..figure import Data
from ..figures.launches import threshold_velocity
from .claim import Finding, collector, verdict

CLAIMS, claim = collector()


@claim(
    place='p. 5',
    how='Newton equilibria of the wall at every defect; a cycle too weak to move it leaves it',
    needs=('peaks',),
)
def eight_levels(study: Data) -> Finding:
    """Case II imbues the metamaterial with eight pinning sites, sufficient for 3-bit storage."""
    weak = np.abs(study['peaks']) < 0.018
    stay = bool(np.all(study['moved'][:, weak] == 0))
    levels, bits = len(study['levels']), int(np.log2(len(study['levels'])))
    return Finding(
        verdict(stay and levels == 8),
        f'{levels} levels hold a wall at rest: {bits} bits (the caption of Fig. 1a says 8-bit)',
    )


@claim(
    place='p. 5, Fig. 4a',
    how='the device writes the levels upward, each verified by an echo',
    needs=('4a',),
)
def level_by_level(figure: Data) -> Finding:
    """Cycles of compressive, tensile and zero strain advance the wall level by level."""
    right = figure['success'] & (figure['read'] == figure['levels'])
    tries = int(figure['attempts'].max())
    return Finding(
        verdict(bool(right.all()) and tries == 1),
        f'{int(right.sum())} of {len(right)} steps at the first try',
    )


@claim(
    place='p. 6, Fig. 4a',
    how='one cycle from every level over a sweep of peak strains',
    needs=('peaks',),
)
def one_step_per_cycle(study: Data) -> Finding:
    """One strain cycle moves the wall from a defect site to the next one."""
    texts, sure = [], []
    for name, sign, rows in (
        ('compression', -1.0, study['by_compression']),
        ('tension', 1.0, ~study['by_compression']),
    ):
        rows = rows & (study['levels'] < CASE_II.levels - 1)
        side = sign * study['peaks'] > 0.0
        works = np.all(study['moved'][np.ix_(rows, side)] == 1, axis=0)
        peaks = 1e3 * study['peaks'][side][works]
        sure.append(bool(len(peaks)))
        if len(peaks):
            texts.append(
                f'{name} of {np.abs(peaks).min():.0f}e-3 to {np.abs(peaks).max():.0f}e-3 from '
                f'levels {", ".join(str(m) for m in study["levels"][rows])}'
            )
    return Finding(verdict(all(sure)), 'all peaks tried of ' + '; '.join(texts))


@claim(
    place='p. 6',
    how='one cycle from every level over a sweep of peak strains of both signs',
    needs=('peaks',),
)
def unidirectional(study: Data) -> Finding:
    """The wall is restricted to unidirectional motion from left to right."""
    back = int(np.count_nonzero(study['shift'] < -1.0))
    return Finding(
        verdict(back == 0),
        f'{back} of {study["shift"].size} cycles moved a wall to the left; the least shift is '
        f'{study["shift"].min():+.2f} cells, the greatest {study["shift"].max():+.1f}',
    )


@claim(
    place='p. 6, Fig. 4a inset',
    how="the wall's path in the write of Fig. 4a",
    needs=('4a',),
)
def four_events(figure: Data) -> Finding:
    """Events (1) to (4): de-pinning, temporary re-pinning under strain, drift by the gradient as
    the strain falls, pinning at the next defect.
    """
    held, final, worst = [], [], 0.0
    begun = [*figure['begun'], figure['t'][-1] + 1.0]
    for start, stop, level in zip(begun[:-1], begun[1:], figure['levels'], strict=True):
        inside = (figure['t'] >= start) & (figure['t'] < stop)
        strain, wall = np.abs(figure['strain'][inside]), figure['wall'][inside]
        peak = np.flatnonzero(strain > 0.999 * strain.max())
        home = CASE_II.defect(int(level) - 1)
        held.append(float(wall[peak[-1]] - home))
        final.append(float(wall[-1] - home))
        worst = max(worst, abs(final[-1] - CASE_II.J))
    between = all(10.0 < h < 22.0 for h in held)
    return Finding(
        verdict(between and worst < 0.5),
        f'at the peak the wall is held {min(held):.1f} to {max(held):.1f} cells on (the extrema '
        f'of s are 17 on), and ends within {worst:.2f} cells of the next defect',
    )


@claim(
    place='p. 6, Fig. 5',
    how='the device writes and erases every level; the true configuration is looked at',
    needs=('5',),
)
def erase(figure: Data) -> Finding:
    """A kink conveyed across the element returns it to the inactive phase, from any level."""
    blank = figure['erased'] & (figure['left'] == -1)
    cycles = figure['cycles']
    return Finding(
        verdict(bool(blank.all())),
        f'{int(blank.sum())} of {len(blank)} levels erased, with '
        f'{", ".join(str(c) for c in cycles)} strain cycles after the launch',
    )


@claim(
    place='p. 6, Fig. 5',
    how='initial velocity of the free first cell of an active element, swept, with and without '
    'strain',
    needs=('launches',),
)
def printed_launch(study: Data) -> Finding:
    """An initial velocity of -0.6148 at j = 1 creates the kink."""
    at = int(np.argmin(np.abs(study['kick_velocity'] - study['printed'])))
    made = ~np.isnan(study['kink'][:, at])
    slowest = threshold_velocity(study)
    kinks = study['kink'][0][~np.isnan(study['kink'][0])]
    strained = study['kink'][1][~np.isnan(study['kink'][1])]
    return Finding(
        verdict(bool(made[0]), in_part=bool(made.any())),
        f'{float(study["printed"]):g} creates none, strained or not; it takes {slowest:.2f}, and '
        f'then the kink overshoots to anywhere: j = {kinks.min():.0f} to {kinks.max():.0f} '
        f'without strain, {strained.min():.0f} to {strained.max():.0f} under -0.03',
    )


@claim(
    place='p. 5',
    how='first cell of a blank element moved from s1 to s2 at constant speed under strain',
    needs=('launches',),
)
def moved_launch(study: Data) -> Finding:
    """A wall may be injected from the boundary by an actuator coupled to the boundary site."""
    slow, tense = study['speed'] <= 0.05, (study['strain'] >= 0.015) & (study['strain'] <= 0.05)
    levels = study['level'][np.ix_(tense, slow)]
    unstrained = sorted({int(level) for level in study['level'][0]})
    return Finding(
        verdict(bool(levels.size) and bool(np.all(levels == 0))),
        f'all {levels.size} launches at speeds up to 0.05 under strains of 0.015 to 0.05 rest at '
        f'level 0. Without strain the outcome depends on the speed: levels {unstrained} '
        '(-1 blank, -2 none, 8 all active)',
    )
