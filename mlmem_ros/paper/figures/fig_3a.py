# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Fig. 3a: real and imaginary wavenumber of small waves in both phases, Eq. (4), Case II."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ...device import Settings
from ...physics import CASE_II
from ...physics.dispersion import band, wavenumber
from ...studies.style import MARK, S1, S2, axes_grid, label, new_figure
from ..echoes import PAPER, PRINTED
from ..figure import Data, Figure, Judged, Quality, judged

FIGURE = Figure(
    '3a',
    'Fig. 3a: wavenumbers of both phases',
    caption='Bars at the right: the propagating bands. They overlap.',
    seconds=1,
)

CARRIERS = (PAPER.omega_c, Settings().probe.omega_c, PRINTED.omega_c)
"""Our reading of the paper's carrier, that of our device, and the printed one."""


@FIGURE.data
def compute(quality: Quality) -> Data:
    """Return the complex wavenumber against frequency, and the band edges, for both phases."""
    omega = np.linspace(0.0, 2.6, quality.pick(521, 2601))
    stiffness = np.array([CASE_II.k_s1, CASE_II.k_s2])
    kappa = np.array([wavenumber(omega, k) for k in stiffness])
    return {
        'omega': omega,
        'kappa_R': kappa.real,
        'kappa_I': kappa.imag,
        'bands': np.array([band(k) for k in stiffness]),
        'carriers': np.array(CARRIERS),
        # Smallest d at which the bands would not overlap: k_s2 = k_s1 + 4.
        'd_disjoint': np.array(4.0 / ((stiffness[1] - stiffness[0]) / CASE_II.d)),
    }


@FIGURE.drawing
def draw(data: Data) -> Any:
    """Draw attenuation to the left and propagation to the right, frequency upward."""
    figure = new_figure(4.4, 3.4)
    left, right = axes_grid(figure, 1, 2, sharey=True, width_ratios=(1.0, 1.3))[0]
    for number, color in enumerate((S1, S2)):
        real, imaginary = data['kappa_R'][number].copy(), data['kappa_I'][number].copy()
        low, high = data['bands'][number]
        inside = (data['omega'] >= low) & (data['omega'] <= high)
        real[~inside] = np.nan
        imaginary[inside] = 0.0
        right.plot(real, data['omega'], color=color)
        left.plot(imaginary, data['omega'], color=color)
        right.axhspan(low, high, 0.965 - 0.045 * number, 1.0 - 0.045 * number, color=color, lw=0)
        right.annotate(
            rf'$\Delta_{{s{number + 1}}}$', (0.0, low), (3, -9 if number == 0 else 3),
            textcoords='offset points', color=color,
        )  # fmt: skip
    marks = (('our reading', MARK, '-', -9), ('device', MARK, ':', 2), ('printed', '0.5', '--', 3))
    for omega, (text, color, style, shift) in zip(data['carriers'], marks, strict=True):
        for axes in (left, right):
            axes.axhline(omega, color=color, lw=0.8, ls=style)
        right.annotate(
            f'{text}: {omega:g}', (0.1, omega), (0, shift), textcoords='offset points',
            fontsize=6.5, color=color,
        )  # fmt: skip
    left.invert_xaxis()
    left.set(xlabel=r'attenuation $\kappa_I a$', ylabel=r'frequency $\omega$', ylim=(0.0, 2.6))
    right.set(xlabel=r'propagation $\kappa_R a$', xlim=(0.0, 1.09 * math.pi))
    right.set_xticks([0.0, math.pi / 2.0, math.pi], ['0', r'$\pi/2$', r'$\pi$'])
    label(left, 'a', 'dispersion')
    return figure


# --- claims ------------------------------------------------------------------------------------


@FIGURE.claim(
    'The propagating modes of the two phases have non-overlapping frequency ranges',
    page=5,
    where='Fig. 3a',
    how='Eq. (4) with Table I, Case II; eigenvalues of a ring of cells beside it',
    printed='non-overlapping bands',
)
def _bands(data: Data) -> Judged:
    (low_1, high_1), (low_2, high_2) = data['bands']
    return judged(
        low_2 > high_1,
        f's1: {low_1:.4f} to {high_1:.4f}, s2: {low_2:.4f} to {high_2:.4f}. They share '
        f'{low_2:.3f} to {high_1:.3f}; only {low_1:.3f} to {low_2:.3f} belongs to s1 alone and '
        f'{high_1:.3f} to {high_2:.3f} to s2 alone. Disjoint bands need d > '
        f'{float(data["d_disjoint"]):.3f}, not 0.0380',
        in_part=high_2 > high_1 and low_1 < low_2,
    )
