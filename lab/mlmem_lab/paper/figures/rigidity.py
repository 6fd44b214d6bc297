# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Ours: how stiff the substrate has to be for Eq. (1a) alone to do, with Eq. (1b) beside it."""

from __future__ import annotations

import dataclasses

import numpy as np

from mlmem.moves.strain_cycle import WriteSettings, select_peak
from mlmem.physics import CASE_II, Design, find_level
from mlmem.physics.equilibrium import find_pinned_wall

from ...studies.trace import wall_path
from ..echoes import PAPER_PROBE, detect_echo, record_echo
from ..figure import Data, Figure, Judged, Quality, judge_numbers
from .peaks import run_cycle

definition = Figure('rigidity', 'How stiff the substrate has to be', seconds=10)


@definition.register_data
def compute_data(quality: Quality) -> Data:
    """Make a cycle from every level with Eq. (1a) alone and with Eq. (1b), over s_min.

    Returns:
        Data with `s_min` and `levels`; `moved` (s_min x level), levels moved by a cycle (NaN:
        no level); `difference` (s_min x level), the distance in cells between the mean place of
        the wall at the end of the cycle and that with the rigid substrate; `echo` (s_min), the
        greatest difference of v_1 after a pulse over its amplitude; `delay` (s_min x 2), the
        echo's delay with the elastic and the rigid substrate (NaN: no echo).
    """
    s_min = np.array(quality.pick((100.0, 1000.0), (100.0, 200.0, 400.0, 1000.0, 2000.0, 4000.0)))
    levels = range(quality.pick(2, CASE_II.levels - 1))
    rigid = [_run_cycle(CASE_II, level) for level in levels]
    v = find_pinned_wall(CASE_II, 1)
    moved, difference, echoes, delays = [], [], [], []
    # looks at the end of a cycle, 500 time units, over which a wall that still rings is averaged
    averaged_samples = 50
    for s in s_min:
        design = dataclasses.replace(
            CASE_II, s_min=float(s), s_max=3.0 * float(s), substrate='elastic'
        )
        cycles = [_run_cycle(design, level) for level in levels]
        moved.append([end - level for (_, end), level in zip(cycles, levels, strict=True)])
        places, ideal = (
            [path[-averaged_samples:].mean() for path, _ in runs] for runs in (cycles, rigid)
        )
        difference.append(np.abs(np.subtract(places, ideal)))
        # settling: the substrate gives way under the wall and comes to rest, exp(-8) is left
        other, dt = record_echo(design, v, PAPER_PROBE, duration=400.0, dt=None, settle=4000.0)
        # The same step for both, or its dispersion would be compared.
        heard, _ = record_echo(CASE_II, v, PAPER_PROBE, duration=400.0, dt=dt)
        echoes.append(float(np.abs(other - heard).max()) / PAPER_PROBE.A)
        delays.append([detect_echo(sound, dt, PAPER_PROBE).delay for sound in (other, heard)])
    return {
        's_min': s_min,
        'levels': levels,
        'moved': np.array(moved, dtype=float),
        'difference': difference,
        'echo': echoes,
        'delay': np.array(delays, dtype=float),
    }


def _run_cycle(design: Design, level: int) -> tuple[np.ndarray, float]:
    """Return the wall's path through a cycle and the level after it, NaN for none."""
    peak = select_peak(WriteSettings(), design.is_freed_by_compression(level))
    fields = run_cycle(design, level, peak, save_every=10.0)
    end = find_level(design, fields[-1])
    return wall_path(design, fields), float(end) if end >= 0 else np.nan


@definition.register_claim(
    'A substrate that is, effectively, rigid allows Eq. (1a) alone',
    page=2,
    how='a cycle from every level, with Eqs. (1a, b) and with (1a) alone',
)
def _rigid_suffices(data: Data) -> Judged:
    row = int(np.argmin(np.abs(data['s_min'] - 1000.0)))
    moved, apart = data['moved'][row], data['difference'][row]
    return judge_numbers(
        bool(np.all(moved == 1.0)) and bool(apart.max() < 0.5),
        f'at s_min = 1000 both move the wall by one level from each of {moved.size} levels; '
        f'the walls end within {apart.max():.2f} cells of each other at the end of the cycle, and '
        f'within {data["difference"][-1].max():.1e} at s_min = {data["s_min"][-1]:.0f}',
    )


@definition.register_claim(
    'Proper function requires min(s) >> max(k_r, k_s); no number is printed',
    page=2,
    how='sweep of s_min with s_max = 3 s_min',
    printed='min(s) >> max(k_r, k_s), no number',
)
def _how_rigid(data: Data) -> Judged:
    good = np.all(data['moved'] == 1.0, axis=1)
    listed = '; '.join(
        f'{s:.0f}: {"all steps" if ok else "fails"}'
        for s, ok in zip(data['s_min'], good, strict=True)
    )
    required = bool(good[-1]) and not good.all() and bool(np.all(np.diff(good.astype(int)) >= 0))
    return judge_numbers(
        required,
        f's_min by what one cycle does: {listed}. At {data["s_min"][0]:.0f}, '
        f'{int(np.sum(data["moved"][0] == 1.0))} of {data["moved"].shape[1]} steps are made. '
        'The substrate gives way under the wall and traps it where the gradient alone would '
        'move it',
        in_part=bool(good[-1]),
    )


@definition.register_claim(
    'At low frequency the metamaterial may be treated in isolation',
    page=2,
    how='the same pulse and wall with Eqs. (1a, b) and with (1a) alone, the same step',
    replaced='carrier 2.0, threshold 7.5e-5',
)
def _low_frequency(data: Data) -> Judged:
    row = int(np.argmin(np.abs(data['s_min'] - 1000.0)))
    apart = float(np.abs(np.diff(data['delay'][row]))[0])
    return judge_numbers(
        bool(data['echo'][row] < 0.05) and apart < 5.0,
        f'at s_min = 1000 v_1 differs by {100 * data["echo"][row]:.1f} % of the pulse, and the '
        f"echo's delay by {apart:.2f}",
    )
