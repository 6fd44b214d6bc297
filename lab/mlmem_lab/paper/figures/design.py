# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How the pieces of a design act together, Case II: pins, strains, gradient, lattice, bands."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from mlmem import Settings
from mlmem.physics import CASE_II
from mlmem.physics.waves import pass_band
from mlmem_tools.checks.quasistatic import compute_held_landscape

from ...studies import style
from ..echoes import PRINTED_PROBE
from ..figure import Data, Figure, Quality

definition = Figure('design', 'How the pieces of a design act together', seconds=1)


@definition.register_data
def compute_data(quality: Quality) -> Data:
    """Return landscapes by strain, the pull on the way to a defect by gamma, and the bands."""
    write = Settings().write
    shown_sites = (20.0, 80.0)  # sites that are shown: level 0 to level 2
    low, high = shown_sites[0], quality.pick(shown_sites[0] + 30.0, shown_sites[1])
    data: Data = {'strains': np.array([0.0, write.compression, write.tension])}
    landscapes = [compute_held_landscape(CASE_II, low, high, strain) for strain in data['strains']]
    data['X'] = landscapes[0].X
    data['U'] = np.array([landscape.energy for landscape in landscapes])
    # Level 0: the extremum that compression drives to is 17 cells ahead of the defect.
    weak_gradient = -6e-5  # a gradient that leaves the wall to the lattice
    gammas = np.array([CASE_II.gamma, weak_gradient])
    designs = (dataclasses.replace(CASE_II, gamma=gamma) for gamma in gammas)
    ways = [compute_held_landscape(design, 42.0, 49.5) for design in designs]
    data |= {'gammas': gammas, 'way': ways[0].X, 'pull': np.array([-way.slope for way in ways])}
    data['bands'] = [pass_band(CASE_II.k_s1), pass_band(CASE_II.k_s2)]
    probes = Settings().probe_right, Settings().probe, PRINTED_PROBE
    return data | {'carriers': [probe.omega_c for probe in probes]}


@definition.register_drawing
def draw_figure(data: Data) -> Any:
    """Draw four panels: at rest, under strain, the way back, and the carriers."""
    figure = style.new_figure(5.2)
    (rest, strained), (way, bands) = style.axes_grid(figure, 2, 2)
    X, U = data['X'], 1e3 * data['U']
    for axes in (rest, strained):
        for site in (25, 50, 75):
            axes.axvline(site, color=style.Colour.FAINT, lw=0.8, zorder=0)
        axes.set(xlabel='wall $X$ (cells)', ylabel=r'energy $U$ ($10^{-3}$)', xlim=(X[0], X[-1]))
    rest.plot(X, U[0], color=style.Colour.INK)
    style.label_panel(rest, 'a', 'no strain (lines: defects)')
    colors = style.Colour.COMPRESSION, style.Colour.TENSION
    for curve, strain, color in zip(U[1:], data['strains'][1:], colors, strict=True):
        strained.plot(X, curve - curve.mean(), color=color, label=rf'$\varepsilon$ = {strain:+g}')
    for site, name in ((42, r'$s_{\max}$'), (67, r'$s_{\min}$')):
        if site <= X[-1]:
            strained.axvline(site, color=style.Colour.MARK, ls=':')
            style.annotate_place(strained, name, (site, 60.0), (2, 0), va='top')
    strained.set_ylim(None, 62.0)
    strained.legend(loc='lower left')
    style.label_panel(strained, 'b', 'at the peaks of a cycle')
    for pull, gamma, dashes in zip(data['pull'], data['gammas'], ('-', '--'), strict=True):
        label = rf'$\gamma$ = {gamma:.3g}'
        way.plot(data['way'], 1e6 * pull, color=style.Colour.INK, ls=dashes, label=label)
    way.axhspan(-30.0, 0.0, color=style.Colour.INACTIVE, alpha=0.3, lw=0)
    way.set(xlabel='wall $X$ (cells)', ylabel=r'pull to the right ($10^{-6}$)', ylim=(-30, 160))
    way.legend(loc='center right')
    style.label_panel(way, 'c', 'the way back: below 0 it stops')
    for row, (name, color) in enumerate(
        (('$s_1$', style.Colour.INACTIVE), ('$s_2$', style.Colour.ACTIVE))
    ):
        low, high = data['bands'][row]
        bands.barh(row, high - low, left=low, height=0.5, color=color)
        style.annotate_place(bands, name, (low, row), (-4, 0), ha='right', va='center')
    names = ('right end', 'left end', 'as printed')
    for omega, name, dashes in zip(data['carriers'], names, (':', ':', '--'), strict=True):
        bands.axvline(omega, color=style.Colour.MARK, ls=dashes)
        style.annotate_place(
            bands, f'{name} {omega:g}', (omega, 3.4), (-2, 0), ha='right', va='top', rotation=90
        )
    bands.set(xlabel=r'frequency $\omega$', xlim=(0.2, 2.6), ylim=(-0.4, 3.5), yticks=[])
    style.label_panel(bands, 'd', 'bands and carriers')
    return figure
