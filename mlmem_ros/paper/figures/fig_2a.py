# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Fig. 2a: the energy landscape of a wall under strain, by Eq. (3) and without an ansatz."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...analysis.landscape import (
    DisplacementFit,
    fit_displacement,
    fit_kink,
    landscape,
    strained,
)
from ...physics import CASE_I, Specimen
from ...physics.held_wall import hold_walls
from ...studies.style import COMPRESSION, FAINT, INK, MARK, TENSION, axes_grid, label, new_figure
from ..figure import Data, Quality

STRAINS = 1e-3 * np.array([-15, -12, -9, -6, -3, 0, 3, 6, 9, 12, 15])

MARGIN = 12.0
"""Cells at either end that are left out: there the wall feels the free ends."""


def compute(quality: Quality) -> Data:
    """Return U(X) by both ways, the fits' errors and orders, for a family of strains.

    The zero of the energy is the strained element without a wall.
    """
    design, kink = CASE_I, fit_kink(CASE_I)
    step = quality.pick(2.0, 0.5)
    X = np.arange(1.0 + MARGIN, design.N - MARGIN + 1e-9, step)
    data: Data = {
        'X': X,
        'strain': STRAINS,
        'kink_constants': [kink.A, kink.B_1, kink.C_1, kink.B_2, kink.C_2],
        'kink_e_rms': kink.e_rms,
    }
    by_ansatz, as_printed, held, fits = [], [], [], []
    for strain in STRAINS:
        v, V = strained(design, float(strain))
        v_0, V_0 = fit_displacement(design, v), fit_displacement(design, V)
        blank = 0.5 * np.sum(np.diff(v) ** 2) + np.sum(
            design.alpha * design.potential.energy(v - V)
        )
        by_ansatz.append(landscape(design, X, kink, v_0, V_0) - blank)
        as_printed.append(landscape(design, X, kink, v_0, V_0, as_printed=True) - blank)
        held.append(hold_walls(Specimen(design), X, V).energy - blank)
        fits.append([(fit.e_rms, fit.q) for fit in (v_0, V_0)])
    data |= {'ansatz': by_ansatz, 'as_printed': as_printed, 'held': held}
    data['fits'] = fits  # strain x (v_0, V_0) x (e_rms, q)
    data |= {'defect': design.J, 'j_0': design.j_0}
    data |= _profiles(design.sites, v_0, V_0, v, V)
    return {name: np.asarray(value) for name, value in data.items()}


def _profiles(
    x: np.ndarray, v_0: DisplacementFit, V_0: DisplacementFit, v: np.ndarray, V: np.ndarray
) -> Data:
    """Return displacements and their fits at the largest strain."""
    return {
        'x': x, 'v_0': v, 'V_0': V,
        'v_0_fit': v_0.displacement(x), 'V_0_fit': V_0.displacement(x),
    }  # fmt: skip


def draw(data: Data) -> Any:
    """Draw both halves of the family, and below what the ansatz makes different."""
    figure = new_figure(6.8, 4.2)
    grid = axes_grid(figure, 2, 2, height_ratios=(3.0, 1.0), sharex=True)
    x = data['X'] - data['defect']
    halves = ((-1.0, COMPRESSION, 'compression'), (1.0, TENSION, 'tension'))
    for column, (sign, color, text) in enumerate(halves):
        upper, lower = grid[:, column]
        chosen = [i for i, e in enumerate(data['strain']) if e * sign >= 0.0]
        largest = np.abs(data['strain']).max()
        for i in chosen:
            strain = data['strain'][i]
            shade = 0.35 + 0.65 * abs(strain) / largest
            ink = INK if strain == 0.0 else color
            upper.plot(x, data['ansatz'][i], color=ink, alpha=shade, lw=1.2)
            every = max(1, round(6.0 / (x[1] - x[0])))
            upper.plot(
                x[::every], data['held'][i][::every], 'o', color=ink, ms=2.2, mfc='w', mew=0.6
            )
            upper.annotate(
                f'{1e3 * strain:+.0f}' if strain else '0',
                (x[-1], data['ansatz'][i][-1]), (3, 0), textcoords='offset points',
                va='center', fontsize=6.5, color=ink,
            )  # fmt: skip
            lower.plot(x, 1e3 * (data['ansatz'][i] - data['held'][i]), color=ink, alpha=shade)
        for axes in (upper, lower):
            axes.axvline(0.0, color=FAINT, lw=0.6, zorder=0)
            axes.axvline(data['j_0'] - data['defect'], color=MARK, lw=0.6, ls='--', zorder=0)
        top = upper.get_ylim()[1]
        upper.annotate('defect', (0, top), fontsize=6.5, ha='left', va='top', color='0.45')
        upper.annotate(
            r'$s_{\min}$ ', (data['j_0'] - data['defect'], top), fontsize=7, ha='right',
            va='top', color=MARK,
        )  # fmt: skip
        label(upper, 'a', rf'{text}, labels $\varepsilon\times10^3$')
        lower.set(xlabel=r'$x = X - 100$ (cells)', ylim=(0.0, 1.5))
        lower.axhline(0.0, color=FAINT, lw=0.5)
    grid[0, 0].set_ylabel(r'$U(X)$ over the wall-less element')
    grid[1, 0].set_ylabel('Eq. (3)\n' r'$-$ held, $10^{-3}$')
    grid[0, 0].plot([], [], color=INK, label='Eq. (3), ansatz')
    grid[0, 0].plot([], [], 'o', color=INK, ms=2.2, mfc='w', mew=0.6, label='held wall, no ansatz')
    grid[0, 0].legend(loc='upper right')
    return figure
