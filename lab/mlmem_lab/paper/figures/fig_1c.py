# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Fig. 1c: (i) the on-site potential and its stiffness, (ii) the walls between the phases."""

from __future__ import annotations

from typing import Any

import numpy as np

from mlmem.physics import CASE_I, CASE_II
from mlmem.physics.held_wall import hold_walls, make_uniform

from ...studies import style
from ..figure import Data, Figure, Judged, Quality, judge_numbers

definition = Figure('1c', 'Fig. 1c: potential, stiffness and wall profiles', seconds=1)


@definition.register_data
def compute_data(quality: Quality) -> Data:
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
        flat = make_uniform(design)
        middle = flat.N // 2 + 0.5
        (v,) = hold_walls(flat, np.array([middle]), np.zeros(flat.N)).v
        data[f'x_{name}'], data[f'anti_kink_{name}'] = flat.sites - middle, v
    return data


@definition.register_drawing
def draw_figure(data: Data) -> Any:
    """Draw potential and stiffness, and both walls."""
    figure = style.new_figure(3.2)
    left, right = style.axes_grid(figure, 1, 2)[0]
    left.plot(data['D'], data['energy_per_d'], color=style.Colour.INK)
    left.set(
        xlabel=r'configuration $\Delta$ (cells)', ylabel=r'potential $\psi/d$', ylim=(-0.2, 3.2)
    )
    stiffness = left.twinx()
    stiffness.spines.right.set_visible(True)
    stiffness.plot(data['D'], data['stiffness_per_d'], color=style.Colour.MARK, lw=1.0, ls='--')
    stiffness.set_ylabel(r"stiffness $\psi''/d$ (dashed)")
    stiffness.set_ylim(-22.0, 44.0)
    phases = style.Colour.INACTIVE, style.Colour.ACTIVE
    states = zip(phases, data['ground_states'], data['stiffnesses_per_d'], strict=True)
    for number, (color, D, k) in enumerate(states, 1):
        left.plot(D, 0.0, 'o', color=color, ms=7, clip_on=False, zorder=5)
        text = rf'$\Delta_{{s{number}}}={D:.3f}$' + '\n' + rf'$k_{{s{number}}}={k:.2f}\,d$'
        style.annotate_place(left, text, (D, 2.5), ha='center')
    style.label_panel(left, 'c.i', 'on-site potential')
    for name, marker, text in (('case_1', 'o', 'Case I'), ('case_2', 's', 'Case II')):
        x, v = data[f'x_{name}'], data[f'anti_kink_{name}']
        near = np.abs(x) < 26.0
        colors = np.where(v[near] > data['barrier'], style.Colour.ACTIVE, style.Colour.INACTIVE)
        right.plot(x[near], v[near], color=style.Colour.INK, lw=0.6)
        right.scatter(x[near], v[near], c=colors, s=14, marker=marker, label=f'anti-kink, {text}')
    right.plot(-x[near], v[near], color=style.Colour.FAINT, ls='--', label='kink, Case II')
    right.set(
        xlabel=r'cells from the wall, $j - X$', ylabel=r'$\Delta_j$ (cells)', ylim=(-1.3, 2.4)
    )
    right.legend(loc='upper right')
    style.label_panel(right, 'c.ii', 'walls at rest')
    return figure


@definition.register_claim(
    'Psi possesses n >= 2 degenerate ground states',
    page=2,
    where='Fig. 1c.i',
    how='energy and slope at the closed-form roots; SciPy minimiser beside it',
)
def _ground_states(data: Data) -> Judged:
    energy, slope = data['ground_energies'], data['ground_slopes']
    low, high = data['ground_states']
    holds = np.abs(energy).max() < 1e-12 and np.abs(slope).max() < 1e-12
    return judge_numbers(
        holds,
        f'D_s1 = {low:.5f}, D_s2 = {high:.5f}; energies within {np.abs(energy).max():.0e} of '
        f'each other, slopes within {np.abs(slope).max():.0e} of zero',
    )


@definition.register_claim(
    'The linear on-site stiffness about each ground state is unique',
    page=2,
    where='Fig. 1c.i',
    how='psi" at the roots; complex step beside it',
)
def _stiffnesses(data: Data) -> Judged:
    k_1, k_2 = data['stiffnesses_per_d']
    return judge_numbers(
        k_2 > 1.5 * k_1 > 0.0,
        f'k_s1 = {k_1:.4f} d, k_s2 = {k_2:.4f} d: a ratio of {k_2 / k_1:.3f}',
    )
