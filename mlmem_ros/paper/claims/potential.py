# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Claims about the potential and the wall by itself (Fig. 1, page 3)."""

from __future__ import annotations

import numpy as np

from ..figure import Data
from ..figures import gradient
from .claim import Finding, collector, verdict

CLAIMS, claim = collector()


@claim(
    place='p. 2, Fig. 1c.i',
    how='energy and slope at the closed-form roots; SciPy minimiser beside it',
    needs=('1c',),
)
def ground_states(figure: Data) -> Finding:
    """Psi possesses n >= 2 degenerate ground states."""
    energy, slope = figure['ground_energies'], figure['ground_slopes']
    low, high = figure['ground_states']
    holds = np.abs(energy).max() < 1e-12 and np.abs(slope).max() < 1e-12
    return Finding(
        verdict(bool(holds)),
        f'D_s1 = {low:.5f}, D_s2 = {high:.5f}; energies within {np.abs(energy).max():.0e} of '
        f'each other, slopes within {np.abs(slope).max():.0e} of zero',
    )


@claim(
    place='p. 2, Fig. 1c.i',
    how='psi" at the roots; complex step beside it',
    needs=('1c',),
)
def stiffnesses(figure: Data) -> Finding:
    """The linear on-site stiffness about each ground state is unique."""
    k_1, k_2 = figure['stiffnesses_per_d']
    return Finding(
        verdict(k_2 > 1.5 * k_1 > 0.0),
        f'k_s1 = {k_1:.4f} d, k_s2 = {k_2:.4f} d: a ratio of {k_2 / k_1:.3f}',
    )


@claim(
    place='p. 3',
    how='rms departure, over 41 cells about the moving wall, from the resting wall of the '
    'uniform element at the same place (Case I, no defect)',
    needs=('gradient',),
)
def permanent_profile(study: Data) -> Finding:
    """The (anti-)kink exhibits a permanent profile while travelling the length of the system."""
    worst = max(float(study[f'profile_{name}'].max()) for name in ('anti_kink', 'kink'))
    step = 2.0
    return Finding(
        verdict(worst < 0.01 * step),
        f'at most {worst:.1e} of a step of {step:g}: {50.0 * worst:.2g} %. It grows with the '
        'distance because alpha falls and the wall widens',
    )


@claim(
    place='p. 2',
    how='time integration (Case I, no defect), four damping times after release',
    needs=('gradient',),
)
def constant_speed(study: Data) -> Finding:
    """A wall in the uniform gradient propagates to the right with constant speed."""
    steady = study['t'] > gradient.ENTRANCE
    speed = np.array([study[f'speed_{name}'][steady] for name in ('anti_kink', 'kink')])
    forecast = gradient.closed_form(study, study['path_anti_kink'][steady])
    error = float(np.abs(speed[0] / forecast - 1.0).max())
    spread = float(np.ptp(speed) / speed.mean())
    return Finding(
        verdict(bool(speed.min() > 0.0) and spread < 0.1 and error < 0.05),
        f'{speed.mean():.4f} cells per time unit, constant within {100 * spread:.1f} %; the '
        f'closed form -gamma/(2 eta alpha) is met within {100 * error:.1f} %, and explains the '
        'slow rise by the falling alpha',
    )


@claim(
    place='p. 2',
    how='both kinds of wall let go at rest',
    needs=('gradient',),
)
def both_kinds(study: Data) -> Finding:
    """The gradient supports uni-directional propagation of both kink and anti-kink."""
    moved = [float(np.ptp(study[f'path_{name}'])) for name in ('anti_kink', 'kink')]
    right = [
        bool(np.all(np.diff(study[f'path_{name}'])[5:] > 0)) for name in ('anti_kink', 'kink')
    ]
    return Finding(
        verdict(all(right)),
        f'both move right only: the anti-kink by {moved[0]:.1f}, the kink by {moved[1]:.1f} '
        f'cells in {study["t"][-1]:.0f} time units',
    )


@claim(
    place='p. 2',
    how='Case I with its defect, anti-kink let go at rest 50 cells before it',
    needs=('gradient',),
)
def pinned_by_the_defect(study: Data) -> Finding:
    """A wave travels until it enters the well of a soft defect, where dissipation pins it."""
    end, defect = float(study['path_defect'][-1]), float(study['defect'])
    passed = float(study['path_defect'].max())
    return Finding(
        verdict(abs(end - defect) < 1.0),
        f'it comes to X = {passed:.1f} and rests at {end:.2f}; the defect is at {defect:.0f}',
    )
