# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How the pieces of a design act together, Case II: pins, strains, gradient, lattice, bands."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from ...analysis.quasistatic import held_landscape
from ...device import Settings
from ...physics import CASE_II
from ...physics.dispersion import band
from ...studies.style import (
    COMPRESSION,
    FAINT,
    INK,
    MARK,
    S1,
    S2,
    TENSION,
    axes_grid,
    label,
    new_figure,
)
from ..echoes import PRINTED
from ..figure import Data, Figure, Quality

FIGURE = Figure(
    'design',
    'How the pieces of a design act together',
    caption='Case II: pins, strains, the way back to a defect, and the carriers; the design '
    'guide explains them.',
    seconds=1,
)

SPAN = (20.0, 80.0)
"""Sites that are shown: level 0 to level 2."""

WEAK = -6e-5
"""A gradient that leaves the wall to the lattice."""


@FIGURE.data
def compute(quality: Quality) -> Data:
    """Return landscapes by strain, the pull on the way to a defect by gamma, and the bands."""
    write = Settings().write
    low, high = SPAN[0], quality.pick(SPAN[0] + 30.0, SPAN[1])
    data: Data = {'strains': np.array([0.0, write.compression, write.tension])}
    landscapes = [held_landscape(CASE_II, low, high, strain) for strain in data['strains']]
    data['X'] = landscapes[0].X
    data['U'] = np.array([landscape.energy for landscape in landscapes])
    # Level 0: the extremum that compression drives to is 17 cells ahead of the defect.
    gammas = np.array([CASE_II.gamma, WEAK])
    ways = [
        held_landscape(dataclasses.replace(CASE_II, gamma=gamma), 42.0, 49.5) for gamma in gammas
    ]
    data |= {'gammas': gammas, 'way': ways[0].X, 'pull': np.array([-way.slope for way in ways])}
    data['bands'] = np.array([band(CASE_II.k_s1), band(CASE_II.k_s2)])
    data['carriers'] = np.array(
        [Settings().probe_right.omega_c, Settings().probe.omega_c, PRINTED.omega_c]
    )
    return data


@FIGURE.drawing
def draw(data: Data) -> Any:
    """Draw four panels: at rest, under strain, the way back, and the carriers."""
    figure = new_figure(6.8, 4.2)
    (rest, strained), (way, bands) = axes_grid(figure, 2, 2)
    X = data['X']
    defects = [site for site in (25, 50, 75) if X[0] <= site <= X[-1]]
    for axes in (rest, strained):
        for site in defects:
            axes.axvline(site, color=FAINT, lw=0.6, zorder=0)
        axes.set(xlabel='wall at site $X$', ylabel=r'$U \times 10^3$')
    rest.plot(X, 1e3 * data['U'][0], color=INK)
    label(rest, 'a', 'no strain: defects in a gentle slope')
    for U, strain, color in zip(
        data['U'][1:], data['strains'][1:], (COMPRESSION, TENSION), strict=True
    ):
        strained.plot(X, 1e3 * (U - U.mean()), color=color, label=rf'$\varepsilon$ = {strain:+g}')
    for site, name in ((42, r'$s_{\max}$'), (67, r'$s_{\min}$')):
        if site <= X[-1]:
            strained.axvline(site, color=MARK, lw=0.8, ls=':')
            strained.annotate(name, (site, 1.0), (2, -2), xycoords=('data', 'axes fraction'),
                              textcoords='offset points', va='top', color=MARK)  # fmt: skip
    strained.legend(loc='lower left')
    label(strained, 'b', 'at the peak of a cycle')
    for pull, gamma, style in zip(data['pull'], data['gammas'], ('-', '--'), strict=True):
        way.plot(data['way'], 1e6 * pull, color=INK, ls=style, label=rf'$\gamma$ = {gamma:.3g}')
    way.axhspan(-30.0, 0.0, color=S1, alpha=0.12, lw=0)
    way.set(xlabel='wall at site $X$', ylabel=r'pull to the right $\times 10^6$', ylim=(-30, 160))
    way.legend(loc='upper left')
    label(way, 'c', 'the way back: below 0 it stops')
    for row, (name, color) in enumerate((('$s_1$', S1), ('$s_2$', S2))):
        low, high = data['bands'][row]
        bands.barh(row, high - low, left=low, height=0.5, color=color, lw=0)
        bands.annotate(name, (low, row), (-4, 0), textcoords='offset points', ha='right',
                       va='center', color=color)  # fmt: skip
    names = ('right end', 'left end', 'as printed')
    for omega, name, style in zip(data['carriers'], names, (':', ':', '--'), strict=True):
        bands.axvline(omega, color=MARK, ls=style, lw=1.0)
        bands.annotate(f'{name} {omega:g}', (omega, 2.6), (-2, 0), textcoords='offset points',
                       ha='right', va='top', rotation=90, fontsize=6.5, color=MARK)  # fmt: skip
    bands.set(xlabel=r'frequency $\omega$', xlim=(0.2, 2.6), ylim=(-0.4, 2.7), yticks=[])
    label(bands, 'd', 'bands of both phases')
    return figure
