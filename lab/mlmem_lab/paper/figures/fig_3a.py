# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Fig. 3a: real and imaginary wavenumber of small waves in both phases, Eq. (4), Case II."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from mlmem import Settings
from mlmem.physics import CASE_II
from mlmem.physics.waves import pass_band, wavenumber

from ...studies import style
from ..echoes import PAPER_PROBE, PRINTED_PROBE
from ..figure import Data, Figure, Judged, Quality, judge_numbers

definition = Figure('3a', 'Fig. 3a: wavenumbers of both phases', seconds=1)


@definition.register_data
def compute_data(quality: Quality) -> Data:
    """Return the complex wavenumber against frequency, and the band edges, for both phases."""
    omega = np.linspace(0.0, 2.6, quality.pick(521, 2601))
    stiffness = np.array([CASE_II.k_s1, CASE_II.k_s2])
    kappa = np.array([wavenumber(omega, k) for k in stiffness])
    return {
        'omega': omega,
        'kappa_R': kappa.real,
        'kappa_I': kappa.imag,
        'bands': [pass_band(k) for k in stiffness],
        # our reading of the paper's carrier, that of our device, and the printed one
        'carriers': [each.omega_c for each in (PAPER_PROBE, Settings().probe, PRINTED_PROBE)],
        # Smallest d at which the bands would not overlap: k_s2 = k_s1 + 4.
        'd_disjoint': 4.0 / ((stiffness[1] - stiffness[0]) / CASE_II.d),
    }


@definition.register_drawing
def draw_figure(data: Data) -> Any:
    """Draw attenuation to the left and propagation to the right, frequency upward."""
    figure = style.new_figure(3.8)
    left, right = style.axes_grid(figure, 1, 2, sharey=True, width_ratios=(1.0, 1.6))[0]
    omega = data['omega']
    for number, (color, name) in enumerate(
        ((style.Colour.INACTIVE, 'inactive'), (style.Colour.ACTIVE, 'active'))
    ):
        low, high = data['bands'][number]
        inside = (omega >= low) & (omega <= high)
        text = rf'$\Delta_{{s{number + 1}}}$, {name}'
        right.plot(
            np.where(inside, data['kappa_R'][number], np.nan), omega, color=color, label=text
        )
        left.plot(np.where(inside, 0.0, data['kappa_I'][number]), omega, color=color)
        right.axvspan(
            3.25 + 0.12 * number, 3.33 + 0.12 * number, low / 2.6, high / 2.6, color=color
        )
    names = (
        ('minimal repair', '-', style.Colour.MARK),
        ('this device', ':', style.Colour.MARK),
        (style.Label.PRINTED, '--', style.Colour.PRINTED),
    )
    shifts = (-11, 3, 3)
    for at, (text, dashes, tint), shift in zip(data['carriers'], names, shifts, strict=True):
        for axes in (left, right):
            axes.axhline(at, color=tint, lw=1.0, ls=dashes)
        style.annotate_place(right, f'carrier {at:g}: {text}', (0.05, at), (0, shift))
    left.invert_xaxis()
    left.set(
        xlabel=r'attenuation $\kappa_I a$ (rad)', ylabel=r'frequency $\omega$', ylim=(0.0, 2.6)
    )
    right.set(xlabel=r'propagation $\kappa_R a$ (rad)', xlim=(0.0, 3.5))
    right.set_xticks([0.0, math.pi / 2.0, math.pi], ['0', r'$\pi/2$', r'$\pi$'])
    right.legend(loc='lower right', bbox_to_anchor=(0.92, 0.0))
    style.label_panel(left, 'a', 'dispersion')
    return figure


@definition.register_claim(
    'The propagating modes of the two phases have non-overlapping frequency ranges',
    page=5,
    where='Fig. 3a',
    how='Eq. (4) with Table I, Case II; eigenvalues of a ring of cells beside it',
    printed='non-overlapping bands',
)
def _bands(data: Data) -> Judged:
    (low_1, high_1), (low_2, high_2) = data['bands']
    return judge_numbers(
        low_2 > high_1,
        f's1: {low_1:.4f} to {high_1:.4f}, s2: {low_2:.4f} to {high_2:.4f}. They share '
        f'{low_2:.3f} to {high_1:.3f}; only {low_1:.3f} to {low_2:.3f} belongs to s1 alone and '
        f'{high_1:.3f} to {high_2:.3f} to s2 alone. Disjoint bands need d > '
        f'{float(data["d_disjoint"]):.3f}, not 0.0380',
        in_part=high_2 > high_1 and low_1 < low_2,
    )
