# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Ours: which shaking of the base, by amplitude and frequency, loses a level.

The base is shaken harmonically, with a smooth rise and fall, and then left alone; a level is
kept when the wall rests at its defect again.
"""

from __future__ import annotations

import itertools
import math
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...device.settings import DisturbanceSettings, ScaleSettings
from ...physics import CASE_II, Chain, Specimen, StateError, level_of, substep_times
from ...physics.dispersion import band
from ...physics.equilibrium import resting_wall
from ...physics.held_wall import hold_walls
from ...physics.potential import Array
from ...studies.style import FAINT, INK, MARK, S1, S2, axes_grid, label, new_figure
from ..figure import Data, Figure, Quality

FIGURE = Figure(
    'retention',
    'Which shaking of the base loses a level',
    caption='The base shakes along the chain for 2500 time units, then rests. Dashed: a '
    'constant acceleration that the landscape holds out against no more. SI: default '
    'scale.',
    seconds=65,
)

SHAKE = 2500.0
"""Duration of the shaking: ten times the damping time 1 / eta, in which resonances build up."""

EDGE = 500.0
"""Rise of the amplitude at its begin, and fall at its end."""

SETTLE = 1500.0
"""Rest before the wall is looked for, as after a strain cycle."""

REACH = 12.0
"""Cells to both sides of a defect in which the landscape holds a wall back."""

HARMLESS = DisturbanceSettings().harmless


@FIGURE.data
def compute(quality: Quality) -> Data:
    """Shake elements with their wall at every level, over amplitude and frequency.

    Returns:
        Data with `omega` (f) in rad per time unit, `amplitude` (a) in lattice constants per
        time unit squared, `levels` (n), `kept` (f x a x n), whether the level was kept,
        `threshold` (f x n), the least amplitude that loses it (NaN: none did); `static`
        (n x 2), the constant acceleration at which the landscape holds the wall no more, to the
        left and to the right; `wall` (n), the frequency of a wall in its defect, and `bands`
        (4), the edges of the pass bands of both phases.
    """
    omega = _frequencies(quality.pick(4, 30), quality.pick(1, 11))
    amplitude = np.geomspace(6e-5, 1e-2, quality.pick(5, 31))
    levels = range(0, CASE_II.levels, quality.pick(4, 1))
    rest = {level: resting_wall(Specimen(CASE_II), level) for level in levels}
    kept = np.array([_kept(float(w), amplitude, rest) for w in omega])
    return {
        'omega': omega,
        'amplitude': amplitude,
        'levels': np.array(levels),
        'kept': kept,
        'threshold': thresholds(amplitude, kept),
        'static': np.array([_static_limits(level) for level in levels]),
        'wall': np.array([_wall_frequency(v) for v in rest.values()]),
        'bands': np.sort([*band(CASE_II.k_s1), *band(CASE_II.k_s2)]),
    }


def _frequencies(coarse: int, fine: int) -> Array:
    """Return frequencies over three decades, more of them about the resonances."""
    resonances = (0.055, *band(CASE_II.k_s1)[:1], *band(CASE_II.k_s2)[:1])
    widths = (0.5, 0.08, 0.08)
    near = [
        at * np.geomspace(1.0 - width, 1.0 + width, fine)
        for at, width in zip(resonances, widths, strict=True)
    ]
    return np.sort(np.concatenate((np.geomspace(0.005, 4.0, coarse), *near)))


def harmonic(omega: float, t: Array) -> Array:
    """Return a harmonic of amplitude 1 at times t of the shaking, which rises and falls."""
    x = np.clip(np.minimum(t, SHAKE - t) / EDGE, 0.0, 1.0)
    return np.asarray(x * x * (3.0 - 2.0 * x) * np.sin(omega * t))


def _kept(omega: float, amplitude: Array, rest: dict[int, Array]) -> NDArray[np.bool_]:
    """Return whether each level survives each amplitude at a frequency, shape (a, n)."""
    dt = Chain(CASE_II).dt
    steps = math.ceil(SHAKE / dt)
    wave = harmonic(omega, substep_times(steps, dt))

    def kept(amplitude: float, level: int) -> bool:
        chain = Chain(CASE_II)
        chain.place(rest[level])
        try:
            chain.advance(np.zeros(2 * steps), shake=amplitude * wave)
            chain.rest(math.ceil(SETTLE / dt))
        except StateError:  # the chain was torn
            return False
        return level_of(CASE_II, chain.configuration) == level

    trials = itertools.product(amplitude.tolist(), rest)
    with ThreadPoolExecutor() as pool:
        found = list(pool.map(lambda trial: kept(*trial), trials))
    return np.array(found).reshape(-1, len(rest))


def thresholds(amplitude: Array, kept: NDArray[np.bool_]) -> Array:
    """Return the least amplitude at which a level is lost, shape (f, n)."""
    lost = ~kept
    first = amplitude[np.argmax(lost, axis=1)]
    return np.where(lost.any(axis=1), first, np.nan)


def _static_limits(level: int) -> tuple[float, float]:
    """Return the constant accelerations that drive a wall off its defect to the left and right.

    A force a on every cell does the work a (D_s2 - D_s1) on a wall that moves by one cell; that
    has to outweigh the steepest slope of the landscape on the way.
    """
    defect = CASE_II.defect(level)
    X = np.arange(defect - REACH, min(defect + REACH, CASE_II.N - 1.0), 0.05)
    energy = hold_walls(Specimen(CASE_II), X, np.zeros(CASE_II.N)).energy
    slope = np.gradient(energy, X) / (CASE_II.D_s2 - CASE_II.D_s1)
    bottom = X[np.argmin(np.where(np.abs(X - defect) < 1.0, energy, np.inf))]
    return float(-slope[bottom > X].min()), float(slope[bottom < X].max())


def _wall_frequency(v: Array) -> float:
    """Return the lowest angular frequency of small motions about a configuration at rest."""
    on_site = CASE_II.alpha * CASE_II.potential.stiffness(v) + 2.0
    on_site[0] -= 1.0
    on_site[-1] -= 1.0
    beside = np.full(CASE_II.N - 1, -1.0)
    matrix = np.diag(on_site) + np.diag(beside, 1) + np.diag(beside, -1)
    return float(np.sqrt(np.linalg.eigvalsh(matrix)[0]))


@FIGURE.drawing
def draw(data: Data) -> Any:
    """Draw how many levels are kept, and the least amplitude that loses each."""
    figure = new_figure(7.0, 3.4)
    left, right = axes_grid(figure, 1, 2, width_ratios=(1.35, 1.0), sharey=True)[0]
    omega, amplitude, n = data['omega'], data['amplitude'], len(data['levels'])
    count = data['kept'].sum(axis=2)
    mesh = left.pcolormesh(
        omega, amplitude, count.T, cmap='RdYlBu', vmin=0, vmax=n, shading='nearest',
        rasterized=True,
    )  # fmt: skip
    bar = figure.colorbar(mesh, ax=left, ticks=range(n + 1), pad=0.02, shrink=0.8)
    bar.set_label('levels kept')
    bar.outline.set_linewidth(0.4)
    label(left, 'a', f'of {n} levels, shaken for {SHAKE:g}')
    for column, threshold in enumerate(data['threshold'].T):
        shade = 0.25 + 0.75 * column / max(1, n - 1)
        right.plot(omega, threshold, color=S2, alpha=shade, lw=0.8)
    worst = np.fmin.reduce(data['threshold'], axis=1)  # passes over NaN
    right.plot(omega, worst, color=S1, lw=1.4, label='worst level')
    right.plot([], [], color=S2, lw=0.8, label='each level')
    label(right, 'b', 'least amplitude that loses a level')
    right.legend(loc='upper left', bbox_to_anchor=(0.0, 0.93))
    for axes in (left, right):
        axes.set(xscale='log', yscale='log', xlabel=r'frequency $\omega$ (rad per time unit)')
        axes.axhline(data['static'].min(), color=INK, lw=0.8, ls='--')
        axes.axhline(HARMLESS, color=MARK, lw=0.8, ls=':')
        for at in (*data['bands'], data['wall'].mean()):
            axes.axvline(at, color=FAINT if axes is right else INK, lw=0.5, zorder=1)
    right.set(xlim=left.get_xlim(), ylim=(amplitude[0], amplitude[-1]))
    _name_lines(right, data)
    left.set_ylabel(r'amplitude (lattice constants per time unit$^2$)')
    _add_si(left, right)
    return figure


def _name_lines(axes: Any, data: Data) -> None:
    """Write beside the lines what they are."""
    style = {'fontsize': 6.0, 'color': INK}
    last = data['omega'][-1]
    for at, text in (
        (data['static'].min(), 'constant: beyond the defect'),
        (HARMLESS, 'disturbance.harmless'),
    ):
        axes.text(last, at * 0.96, text, ha='right', va='top', **style)
    names = (r'$\omega_{s1}$', r'$\omega_{s2}$', 'upper edges', '', 'wall')
    for at, text in zip((*data['bands'], data['wall'].mean()), names, strict=True):
        axes.text(at * 0.97, 2.2 * HARMLESS, text, ha='right', va='center', rotation=90, **style)


def _add_si(left: Any, right: Any) -> None:
    """Add the frequency in Hz and the amplitude in m/s^2 for the default scale."""
    scale = ScaleSettings()
    per_hertz = 2.0 * math.pi * scale.time
    for axes in (left, right):
        top = axes.secondary_xaxis(
            'top', functions=(lambda w: w / per_hertz, lambda f: f * per_hertz)
        )
        top.set_xlabel('frequency (Hz)', fontsize=7)
    unit = scale.acceleration
    side = right.secondary_yaxis('right', functions=(lambda a: a * unit, lambda si: si / unit))
    side.set_ylabel(r'amplitude (m/s$^2$)')
