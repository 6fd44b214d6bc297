# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Fig. 1c: (i) the on-site potential and its stiffness, (ii) the walls between the phases."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...physics import CASE_I, CASE_II, Specimen
from ...physics.excerpt import uniform
from ...physics.held_wall import hold_walls
from ...studies.style import INK, S1, S2, axes_grid, label, new_figure
from ..figure import Data, Figure, Judged, Quality, judged

FIGURE = Figure(
    '1c',
    'Fig. 1c: potential, stiffness and wall profiles',
    caption='Potential, stiffness and both walls at rest.',
    seconds=1,
)


@FIGURE.data
def compute(quality: Quality) -> Data:
    """Return the potential over three ground states and the resting walls of both cases.

    Both cases share a, b and c, so the potential is given per d.
    """
    potential, D = CASE_II.potential, np.linspace(-2.6, 2.6, quality.pick(261, 1041))
    data: Data = {
        'D': D,
        'energy_per_d': potential.energy(D) / CASE_II.d,
        'stiffness_per_d': potential.stiffness(D) / CASE_II.d,
        'ground_states': [CASE_II.D_s1, CASE_II.D_s2],
        'stiffnesses_per_d': [CASE_II.k_s1 / CASE_II.d, CASE_II.k_s2 / CASE_II.d],
        'barrier': CASE_II.D_barrier,
        'ground_energies': potential.energy([CASE_II.D_s1, CASE_II.D_s2]),
        'ground_slopes': potential.slope([CASE_II.D_s1, CASE_II.D_s2]),
    }
    for name, design in (('case_1', CASE_I), ('case_2', CASE_II)):
        flat = uniform(design)
        middle = flat.N // 2 + 0.5
        (v,) = hold_walls(Specimen(flat), np.array([middle]), np.zeros(flat.N)).v
        data[f'x_{name}'], data[f'anti_kink_{name}'] = flat.sites - middle, v
    return data


@FIGURE.drawing
def draw(data: Data) -> Any:
    """Draw potential (black) and stiffness (red), and both walls."""
    figure = new_figure(6.6, 2.6)
    left, right = axes_grid(figure, 1, 2)[0]
    left.plot(data['D'], data['energy_per_d'], color=INK)
    left.set(xlabel=r'configuration $\Delta$', ylabel=r'potential $\psi/d$', ylim=(-0.15, 2.6))
    stiffness = left.twinx()
    stiffness.plot(data['D'], data['stiffness_per_d'], color=S1, lw=0.9)
    stiffness.axhline(0.0, color=S1, lw=0.4, ls=':')
    stiffness.set_ylabel(r"stiffness $\psi''/d$", color=S1)
    stiffness.tick_params(colors=S1, labelsize=7)
    stiffness.set_ylim(-22.0, 32.0)
    for number, (color, ha) in enumerate(((S1, 'center'), (S2, 'center'))):
        D, k = data['ground_states'][number], data['stiffnesses_per_d'][number]
        left.plot(D, 0.0, 'o', color=color, ms=4, clip_on=False, zorder=5)
        left.annotate(
            rf'$\Delta_{{s{number + 1}}}={D:.3f}$' + '\n' + rf'$k_{{s{number + 1}}}={k:.2f}\,d$',
            (D, 0.0), (D, 2.15), ha=ha, fontsize=7, color=color,
        )  # fmt: skip
    label(left, 'c.i', 'on-site potential')
    for name, marker, text in (('case_1', 'o', 'Case I'), ('case_2', 's', 'Case II')):
        x, v = data[f'x_{name}'], data[f'anti_kink_{name}']
        near = np.abs(x) < 26.0
        right.plot(x[near], v[near], '-', color=INK, lw=0.5)
        right.scatter(
            x[near], v[near], c=np.where(v[near] > data['barrier'], S2, S1), s=9,
            marker=marker, label=f'anti-kink, {text}', linewidths=0,
        )  # fmt: skip
        if name == 'case_2':
            right.plot(-x[near], v[near], color='0.6', lw=0.9, ls='--', label='kink, Case II')
    for D, color in zip(data['ground_states'], (S1, S2), strict=True):
        right.axhline(D, color=color, lw=0.4, ls=':')
    right.set(xlabel=r'$j - X$ (cells)', ylabel=r'configuration $\Delta_j$', ylim=(-1.3, 1.3))
    right.legend(loc='center right', fontsize=6.5, bbox_to_anchor=(1.0, 0.62))
    label(right, 'c.ii', 'transition wavefronts')
    return figure


# --- claims ------------------------------------------------------------------------------------


@FIGURE.claim(
    'Psi possesses n >= 2 degenerate ground states',
    page=2,
    where='Fig. 1c.i',
    how='energy and slope at the closed-form roots; SciPy minimiser beside it',
)
def _ground_states(data: Data) -> Judged:
    energy, slope = data['ground_energies'], data['ground_slopes']
    low, high = data['ground_states']
    holds = np.abs(energy).max() < 1e-12 and np.abs(slope).max() < 1e-12
    return judged(
        holds,
        f'D_s1 = {low:.5f}, D_s2 = {high:.5f}; energies within {np.abs(energy).max():.0e} of '
        f'each other, slopes within {np.abs(slope).max():.0e} of zero',
    )


@FIGURE.claim(
    'The linear on-site stiffness about each ground state is unique',
    page=2,
    where='Fig. 1c.i',
    how='psi" at the roots; complex step beside it',
)
def _stiffnesses(data: Data) -> Judged:
    k_1, k_2 = data['stiffnesses_per_d']
    return judged(
        k_2 > 1.5 * k_1 > 0.0,
        f'k_s1 = {k_1:.4f} d, k_s2 = {k_2:.4f} d: a ratio of {k_2 / k_1:.3f}',
    )
