# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Fig. 4b: the delay of the echo at every level, from the left as in the paper, and the right."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from ...device import Settings
from ...device.settings import ProbeSettings
from ...physics import CASE_II, Specimen
from ...physics.dispersion import group_velocity
from ...physics.equilibrium import resting_wall
from ...studies.style import INK, S1, S2, axes_grid, label, new_figure
from ..echoes import PAPER, probe_element
from ..figure import Data, Quality

READERS: dict[str, tuple[str, ProbeSettings]] = {
    'paper': ('left', PAPER),
    'left': ('left', Settings().probe),
    'right': ('right', Settings().probe_right),
}
"""The paper's plain threshold (our reading of it), and the device's two ends."""


def compute(quality: Quality) -> Data:
    """Return the echo delays of all levels by three readers, and of the same with no wall."""
    design = CASE_II
    levels = range(0, design.levels, quality.pick(2, 1))
    data: Data = {'levels': np.array(levels)}
    data['codes'] = np.array([design.code(level) for level in levels])
    for name, (end, probe) in READERS.items():
        delays, peaks = [], []
        for level in levels:
            echo = probe_element(
                design, resting_wall(Specimen(design), level), probe, end, duration=1300.0
            )
            delays.append(np.nan if echo.delay is None else echo.delay)
            peaks.append(echo.threshold_margin)
        data[f'delay_{name}'], data[f'margin_{name}'] = np.array(delays), np.array(peaks)
        data[f'time_of_flight_{name}'] = _time_of_flight(end, probe, np.array(levels))
    full = dataclasses.replace(design, N=4 * design.N, beta=0.0)
    alone = probe_element(full, np.full(full.N, design.D_s2), PAPER, duration=1300.0)
    data['delay_without_wall'] = np.array(np.nan if alone.delay is None else alone.delay)
    data['margin_without_wall'] = np.array(alone.threshold_margin)
    return data


def _time_of_flight(end: str, probe: ProbeSettings, levels: np.ndarray) -> np.ndarray:
    """Return 2 distance / group velocity of the carrier, without offset: Eq. (4)."""
    design = CASE_II
    wall = np.array([design.defect(int(level)) for level in levels])
    k_s = design.k_s2 if end == 'left' else design.k_s1
    distance = wall - 1 if end == 'left' else design.N - wall
    return np.asarray(2.0 * distance / group_velocity(probe.omega_c, k_s))


def draw(data: Data) -> Any:
    """Draw delay against level with its binary code."""
    figure = new_figure(4.6, 3.2)
    axes = axes_grid(figure)[0, 0]
    levels = data['levels']
    right = Settings().probe_right.omega_c
    rows = (
        ('paper', S2, 'o', 5, rf'left end, $\omega_c={PAPER.omega_c:g}$, plain threshold'),
        ('left', INK, '+', 8, 'left end, the device: compensated threshold'),
        ('right', S1, 's', 4, rf'right end, $\omega_c={right:g}$ (ours)'),
    )
    for name, color, marker, size, text in rows:
        axes.plot(
            levels, data[f'delay_{name}'], marker, color=color, ms=size, label=text, mfc='none'
        )
    for name, color in (('paper', S2), ('right', S1)):
        flight = data[f'time_of_flight_{name}']
        offset = float(np.nanmean(data[f'delay_{name}'] - flight))
        axes.plot(levels, flight + offset, '-', color=color, lw=0.6, zorder=0)
    codes = zip(levels, data['codes'], strict=True)
    axes.set_xticks(levels, [f'{level}\n{code}' for level, code in codes])
    axes.set(xlabel='level, memory state', ylabel=r'echo delay $\Delta t$', ylim=(0, None))
    axes.legend(loc='upper left', title=r'lines: 2 distance / group velocity (Eq. 4) + offset')
    label(axes, 'b', 'echo delay of every level')
    return figure
