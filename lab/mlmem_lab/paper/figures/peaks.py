# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Ours: which peak strains move the wall by exactly one level, and which way it can move."""

from __future__ import annotations

import math

import numpy as np

from mlmem import simulate, wall_at
from mlmem.instrument.motion import Cycle, CycleSettings
from mlmem.physics import CASE_II, Design, find_level

from ...studies.trace import wall_position
from ..figure import Data, Figure, Judged, Quality, judge_numbers

definition = Figure('peaks', 'Which peak strains move the wall by one level', seconds=8)


def run_cycle(design: Design, level: int, peak: float, save_every: float = math.inf) -> np.ndarray:
    """Return the configurations during one strain cycle from a resting wall; by default those at
    its beginning and end.
    """
    cycle = Cycle.plan_cycle(CycleSettings(), peak)
    return simulate(
        design, initial=wall_at(level), strain=cycle.strain, duration=cycle.duration,
        save_every=min(save_every, cycle.duration), progress=False,
    ).configuration  # fmt: skip


def cycle_once(level: int, peak: float) -> tuple[int, float]:
    """Return the level after one strain cycle from a resting wall, and the wall's shift.

    Returns:
        The level (-1 blank, -2 no level), and by how many cells the wall has moved to the right;
        a wall that has left through an end counts as standing there.
    """
    end = run_cycle(CASE_II, level, peak)[-1]
    place = wall_position(CASE_II, end)
    if np.isnan(place):
        place = float(CASE_II.N if end[0] > CASE_II.D_barrier else 0)
    return find_level(CASE_II, end), place - CASE_II.defect_site(level)


@definition.register_data
def compute_data(quality: Quality) -> Data:
    """Return the levels and cells moved by one cycle (level x peak), of either sign."""
    levels = range(CASE_II.levels)
    peaks = 1e-3 * quality.pick(
        np.array([-50.0, -34.0, -15.0, 20.0, 48.0]), np.arange(-72.0, 74.0, 2.0)
    )
    lost_level = 9  # stands for a wall that is not at rest at a level: between levels, or gone
    moved = np.full((len(levels), len(peaks)), lost_level)
    shift = np.zeros(moved.shape)
    for row, level in enumerate(levels):
        for column, peak in enumerate(peaks):
            after, shift[row, column] = cycle_once(level, float(peak))
            if after >= 0:
                moved[row, column] = after - level
    return {
        'peaks': peaks,
        'levels': levels,
        'moved': moved,
        'shift': shift,
        'by_compression': [CASE_II.is_freed_by_compression(m) for m in levels],
    }


@definition.register_claim(
    'Case II imbues the metamaterial with eight pinning sites, sufficient for 3-bit storage',
    page=5,
    how='Newton equilibria of the wall at every defect; a cycle too weak to move it leaves it',
)
def _eight_levels(data: Data) -> Judged:
    weak = np.abs(data['peaks']) < 0.018
    stay = bool(np.all(data['moved'][:, weak] == 0))
    levels, bits = len(data['levels']), int(np.log2(len(data['levels'])))
    return judge_numbers(
        stay and levels == 8,
        f'{levels} levels hold a wall at rest: {bits} bits (the caption of Fig. 1a says 8-bit)',
    )


@definition.register_claim(
    'One strain cycle moves the wall from a defect site to the next one',
    page=6,
    where='Fig. 4a',
    how='one cycle from every level over a sweep of peak strains',
)
def _one_step_per_cycle(data: Data) -> Judged:
    texts, sure = [], []
    for name, sign, rows in (
        ('compression', -1.0, data['by_compression']),
        ('tension', 1.0, ~data['by_compression']),
    ):
        rows = rows & (data['levels'] < CASE_II.levels - 1)
        side = sign * data['peaks'] > 0.0
        works = np.all(data['moved'][np.ix_(rows, side)] == 1, axis=0)
        peaks = 1e3 * data['peaks'][side][works]
        sure.append(bool(len(peaks)))
        if len(peaks):
            texts.append(
                f'{name} of {np.abs(peaks).min():.0f}e-3 to {np.abs(peaks).max():.0f}e-3 from '
                f'levels {", ".join(str(m) for m in data["levels"][rows])}'
            )
    return judge_numbers(all(sure), 'all peaks tried of ' + '; '.join(texts))


@definition.register_claim(
    'The wall is restricted to unidirectional motion from left to right',
    page=6,
    how='one slow cycle from every level over a sweep of peak strains of both signs. It holds for '
    'quasi-static strain only: one that is let go in haste takes the wall back',
)
def _unidirectional(data: Data) -> Judged:
    back = int(np.count_nonzero(data['shift'] < -1.0))
    return judge_numbers(
        back == 0,
        f'{back} of {data["shift"].size} cycles moved a wall to the left; the least shift is '
        f'{data["shift"].min():+.2f} cells, the greatest {data["shift"].max():+.1f}',
    )
