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

from mlmem.physics import CASE_II, Chain, Specimen, StateError, find_level, substep_times
from mlmem.physics.equilibrium import find_pinned_wall
from mlmem.physics.held_wall import hold_walls
from mlmem.physics.potential import Array
from mlmem.physics.waves import pass_band
from mlmem.settings import DisturbanceSettings, ScaleSettings

from ...studies import style
from ..figure import Data, Figure, Quality

FIGURE = Figure(
    'retention',
    'Which shaking of the base loses a level',
    seconds=65,
)

SHAKE_DURATION = 2500.0
"""Duration of the shaking: ten times the damping time 1 / eta, in which resonances build up."""

SHAKE_RAMP_TIME = 500.0
"""Rise of the amplitude at its begin, and fall at its end."""

SETTLE_TIME = 1500.0
"""Rest before the wall is looked for, as after a strain cycle."""

LANDSCAPE_REACH_CELLS = 12.0
"""Cells to both sides of a defect in which the landscape holds a wall back."""

SAFE_LIMIT = DisturbanceSettings().harmless


@FIGURE.data
def compute_data(quality: Quality) -> Data:
    """Shake elements with their wall at every level, over amplitude and frequency.

    Returns:
        Data with `omega` (f) in rad per time unit, `amplitude` (a) in lattice constants per
        time unit squared, `levels` (n), `kept` (f x a x n), whether the level was kept,
        `threshold` (f x n), the least amplitude that loses it (NaN: none did); `static`
        (n x 2), the constant acceleration at which the landscape holds the wall no more, to the
        left and to the right; `wall` (n), the frequency of a wall in its defect, and `bands`
        (4), the edges of the pass bands of both phases.
    """
    omega = _choose_frequencies(quality.pick(4, 30), quality.pick(1, 11))
    amplitude = np.geomspace(6e-5, 1e-2, quality.pick(5, 31))
    levels = range(0, CASE_II.levels, quality.pick(8, 1))
    rest = {level: find_pinned_wall(Specimen(CASE_II), level) for level in levels}
    kept = np.array([_survey_levels(float(w), amplitude, rest) for w in omega])
    return {
        'omega': omega,
        'amplitude': amplitude,
        'levels': levels,
        'kept': kept,
        'threshold': loss_thresholds(amplitude, kept),
        'static': [_static_limits(level) for level in levels],
        'wall': [_wall_frequency(v) for v in rest.values()],
        'bands': np.sort([*pass_band(CASE_II.k_s1), *pass_band(CASE_II.k_s2)]),
    }


def _choose_frequencies(coarse: int, fine: int) -> Array:
    """Return frequencies over three decades, more of them about the resonances."""
    resonances = (0.055, *pass_band(CASE_II.k_s1)[:1], *pass_band(CASE_II.k_s2)[:1])
    widths = (0.5, 0.08, 0.08)
    near = [
        at * np.geomspace(1.0 - width, 1.0 + width, fine)
        for at, width in zip(resonances, widths, strict=True)
    ]
    return np.sort(np.concatenate((np.geomspace(0.005, 4.0, coarse), *near)))


def shake_harmonic(omega: float, t: Array) -> Array:
    """Return a harmonic of amplitude 1 at times t of the shaking, which rises and falls."""
    x = np.clip(np.minimum(t, SHAKE_DURATION - t) / SHAKE_RAMP_TIME, 0.0, 1.0)
    return np.asarray(x * x * (3.0 - 2.0 * x) * np.sin(omega * t))


def _survey_levels(omega: float, amplitude: Array, rest: dict[int, Array]) -> NDArray[np.bool_]:
    """Return whether each level survives each amplitude at a frequency, shape (a, n)."""
    dt = Chain(CASE_II).dt
    steps = math.ceil(SHAKE_DURATION / dt)
    wave = shake_harmonic(omega, substep_times(steps, dt))

    def survives_shaking(amplitude: float, level: int) -> bool:
        chain = Chain(CASE_II)
        chain.place(rest[level])
        try:
            chain.advance(np.zeros(2 * steps), shake=amplitude * wave)
            chain.rest(math.ceil(SETTLE_TIME / dt))
        except StateError:  # the chain was torn
            return False
        return find_level(CASE_II, chain.configuration) == level

    trials = itertools.product(amplitude.tolist(), rest)
    with ThreadPoolExecutor() as pool:
        found = list(pool.map(lambda trial: survives_shaking(*trial), trials))
    return np.array(found).reshape(-1, len(rest))


def loss_thresholds(amplitude: Array, kept: NDArray[np.bool_]) -> Array:
    """Return the least amplitude at which a level is lost, shape (f, n)."""
    lost = ~kept
    first = amplitude[np.argmax(lost, axis=1)]
    return np.where(lost.any(axis=1), first, np.nan)


def _static_limits(level: int) -> tuple[float, float]:
    """Return the constant accelerations that drive a wall off its defect to the left and right.

    A force a on every cell does the work a (D_s2 - D_s1) on a wall that moves by one cell; that
    has to outweigh the steepest slope of the landscape on the way.
    """
    defect = CASE_II.defect_site(level)
    X = np.arange(
        defect - LANDSCAPE_REACH_CELLS, min(defect + LANDSCAPE_REACH_CELLS, CASE_II.N - 1.0), 0.05
    )
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


@FIGURE.register_drawing
def draw_figure(data: Data) -> Any:
    """Draw how many levels are kept, and the least amplitude that loses each."""
    figure = style.new_figure(4.4)
    left, right = style.axes_grid(
        figure, 1, 2, width_ratios=(1.25, 1.0), sharex=True, sharey=True
    )[0]
    omega, amplitude, n = data['omega'], data['amplitude'], len(data['levels'])
    mesh = left.pcolormesh(
        omega, amplitude, data['kept'].sum(axis=2).T, cmap='viridis', vmin=0, vmax=n,
        shading='nearest', rasterized=True,
    )  # fmt: skip
    figure.colorbar(mesh, ax=left, location='bottom', shrink=0.8)
    style.label_panel(left, 'a', f'levels kept, of {n}')
    right.plot(omega, data['threshold'], color=style.ACTIVE_COLOUR, lw=0.8)
    right.plot(
        omega,
        np.fmin.reduce(data['threshold'], axis=1),
        color=style.INACTIVE_COLOUR,
        label='worst level',
    )
    style.label_panel(right, 'b', 'least that loses a level')
    right.axhline(data['static'].min(), color=style.INK_COLOUR, ls='--', label='constant')
    right.axhline(SAFE_LIMIT, color=style.MARK_COLOUR, ls=':', label='disturbance.harmless')
    right.legend(loc='lower right', bbox_to_anchor=(1.0, 0.08), frameon=True, edgecolor='w')
    scale = ScaleSettings()
    hertz, unit = 2.0 * math.pi * scale.time, scale.acceleration
    for axes in (left, right):
        axes.set(xscale='log', yscale='log', xlabel=r'frequency $\omega$ (rad per time unit)')
        for at in (*data['bands'], data['wall'].mean()):
            axes.axvline(at, color=style.FAINT_COLOUR, lw=0.8, zorder=0 if axes is right else 2)
        top = axes.secondary_xaxis('top', functions=(lambda w: w / hertz, lambda f: f * hertz))
        top.set_xlabel('frequency (Hz)')
    left.set_ylabel('amplitude (cells per time unit$^2$)')
    side = right.secondary_yaxis('right', functions=(lambda a: a * unit, lambda si: si / unit))
    side.set_ylabel('amplitude (m/s$^2$)')
    right.set_ylim(amplitude[0], amplitude[-1])
    return figure
