# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Ours: which launches start a wall: a kicked cell, as printed for Fig. 5, and a moved one."""

from __future__ import annotations

import math

import numpy as np

from mlmem.instrument.end import EndMove
from mlmem.instrument.motion import Ramp
from mlmem.moves.strain_cycle import EraseSettings, WriteSettings
from mlmem.physics import CASE_II, Chain, find_level, find_walls, substep_times

from ..echoes import drive_end
from ..figure import Data, Figure, Judged, Quality, judge_numbers

definition = Figure(
    'launches', 'Which launches start a wall, the printed one included', seconds=11
)


@definition.register_data
def compute_data(quality: Quality) -> Data:
    """Kick or move the first cell and see which wall is left when the strain is released.

    Returns:
        Data with `kick_velocity`, `kink` (strain x velocity: where the kink rests in an element
        that was active throughout, NaN for no kink); `driven_strain`, `driven`: the same of a cell
        driven at the printed speed; `speed`, `strain`, `level` (strain x speed: the level after
        moving the first cell of a blank element; 8 stands for active throughout, -1 for blank, -2
        for no level).
    """
    printed_velocity = -0.6148
    velocity = np.unique(np.r_[np.linspace(-3.0, 0.0, quality.pick(7, 121)), printed_velocity])
    # without strain as printed, and under the compression that our erase is launched with
    kick_strains = (0.0, -0.03)
    kicked = [[kick_cell(float(v), strain) for v in velocity] for strain in kick_strains]
    # under which the first cell is driven at the printed speed
    driven_strains = (-0.05, -0.04, -0.03, -0.02, -0.01, 0.0, 0.01, 0.02, 0.03, 0.04, 0.05)
    driven = [kick_cell(printed_velocity, strain, driven=True) for strain in driven_strains]
    speed = np.geomspace(0.01, 2.0, quality.pick(3, 24))
    strain = np.linspace(0.0, 0.06, quality.pick(3, 21))
    level = [[_move_cell(float(v), float(e)) for v in speed] for e in strain]
    return {
        'kick_velocity': velocity,
        'kink': kicked,
        'driven_strain': driven_strains,
        'driven': driven,
        'speed': speed,
        'strain': strain,
        'level': level,
        'printed': printed_velocity,
    }


def kick_cell(velocity: float, strain: float, driven: bool = False) -> float:
    """Return where the kink of a kicked first cell rests; NaN for none or several.

    A driven cell is held at this velocity all the way from s2 to s1.
    """
    times = EraseSettings()
    chain = Chain(CASE_II)
    chain.place(np.full(CASE_II.N, CASE_II.D_s2))
    _play_ramp(chain, Ramp(0.0, strain, times.ramp))
    if driven:
        move = EndMove(chain.end(1), CASE_II.D_s1, abs(velocity))
        drive_end(chain, move, move.duration + times.hold)
    else:
        state = chain.state()
        state[1, 0] = velocity
        chain.restore(state, V_N=chain.V_N, steps_done=chain.steps_done)
        chain.advance_steps(math.ceil(times.hold / chain.dt))
    _play_ramp(chain, Ramp(strain, 0.0, times.release))
    chain.advance_steps(math.ceil(times.settle / chain.dt))
    found = find_walls(CASE_II, chain.configuration)
    kinks = [wall.position for wall in found if not wall.anti_kink]
    if len(kinks) == 1:
        return kinks[0]
    gone = not found and chain.configuration[0] < CASE_II.D_barrier
    return float(CASE_II.N) if gone else math.nan


def _move_cell(speed: float, strain: float) -> int:
    """Return the level after the first cell of a blank element was moved under a strain."""
    times = WriteSettings()
    chain = Chain(CASE_II)
    _play_ramp(chain, Ramp(0.0, strain, times.ramp))
    move = EndMove(chain.end(1), CASE_II.D_s2, speed)
    drive_end(chain, move, move.duration + times.hold)
    _play_ramp(chain, Ramp(strain, 0.0, times.release))
    chain.advance_steps(math.ceil(times.settle / chain.dt))
    if chain.configuration.min() > CASE_II.D_barrier:
        return CASE_II.levels
    return find_level(CASE_II, chain.configuration)


def _play_ramp(chain: Chain, ramp: Ramp) -> None:
    """Strain a chain; a ramp from zero to zero takes no time."""
    if not ramp.is_wait:
        at = substep_times(round(ramp.duration / chain.dt), chain.dt)
        chain.advance(ramp.strain(at) * CASE_II.end_displacement(1.0))


def threshold_velocity(data: Data) -> float:
    """Return the slowest kick that leaves a kink without strain, NaN if none does."""
    made = ~np.isnan(data['kink'][0])
    return float(data['kick_velocity'][made].max()) if made.any() else math.nan


@definition.register_claim(
    'An initial velocity of -0.6148 at j = 1 creates the kink',
    page=6,
    where='Fig. 5',
    how='initial velocity of the free first cell of an active element, swept, with and without '
    'strain; the cell driven at 0.6148 under strains of -0.05 to 0.05',
    printed='initial velocity -0.6148',
)
def _printed_launch(data: Data) -> Judged:
    at = int(np.argmin(np.abs(data['kick_velocity'] - data['printed'])))
    made = ~np.isnan(data['kink'][:, at])
    slowest = threshold_velocity(data)
    driven = data['driven_strain'][~np.isnan(data['driven'])]
    kinks = data['kink'][0][~np.isnan(data['kink'][0])]
    strained = data['kink'][1][~np.isnan(data['kink'][1])]
    return judge_numbers(
        made[0],
        f'given to a free cell, {float(data["printed"]):g} creates none, strained or not; it '
        f'takes {slowest:.2f}, and then the kink overshoots to anywhere: j = {kinks.min():.0f} to '
        f'{kinks.max():.0f} without strain, {strained.min():.0f} to {strained.max():.0f} under '
        f'-0.03. A cell driven at 0.6148 launches a kink under {len(driven)} of '
        f'{len(data["driven"])} strains ({", ".join(f"{strain:g}" for strain in driven)})',
        in_part=bool(made.any()) or bool(len(driven)),
    )


@definition.register_claim(
    'A wall may be injected from the boundary by an actuator coupled to the boundary site',
    page=5,
    how='first cell of a blank element moved from s1 to s2 at constant speed under strain',
)
def _moved_launch(data: Data) -> Judged:
    slow, tense = data['speed'] <= 0.05, (data['strain'] >= 0.015) & (data['strain'] <= 0.05)
    levels = data['level'][np.ix_(tense, slow)]
    unstrained = sorted({int(level) for level in data['level'][0]})
    return judge_numbers(
        bool(levels.size) and bool(np.all(levels == 0)),
        f'all {levels.size} launches at speeds up to 0.05 under strains of 0.015 to 0.05 rest at '
        f'level 0. Without strain the outcome depends on the speed: levels {unstrained} '
        '(-1 blank, -2 none, 8 all active)',
    )
