# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Claims about the strain-tunable energy landscape (Fig. 2, pages 3 and 4)."""

from __future__ import annotations

import numpy as np

from ...analysis.landscape import BOUND
from ...physics import CASE_II
from ..figure import Data
from .claim import Finding, collector, verdict

CLAIMS, claim = collector()

HELD = 'held wall (no ansatz) and Eq. (3)'


@claim(
    place='p. 3',
    how='least squares of linear + Fourier terms, least order q that meets the bound',
    needs=('2a',),
)
def displacement_fits(figure: Data) -> Finding:
    """The ansatzes fit with an rms error below 1.35e-4: the initial displacements v_0 and V_0."""
    e_rms, q = figure['fits'][..., 0], figure['fits'][..., 1]
    return Finding(
        verdict(bool(e_rms.max() < BOUND)),
        f'e_rms at most {e_rms.max():.2e}, with q up to {q[:, 0].max():.0f} for v_0 and '
        f'{q[:, 1].max():.0f} for V_0',
    )


@claim(
    place='p. 3',
    how='least squares of all five constants to the resting wall (Case I); SciPy from random '
    'starts finds nothing better (independent check)',
    needs=('2a',),
)
def kink_fit(figure: Data) -> Finding:
    """The ansatzes fit with an rms error below 1.35e-4: the arctan kink."""
    e_rms = float(figure['kink_e_rms'])
    return Finding(
        verdict(e_rms < BOUND),
        f'e_rms = {e_rms:.2e} at best, {e_rms / BOUND:.1f} times the bound. The landscape does '
        'not suffer (`ansatz_against_held`)',
    )


@claim(
    place='p. 2',
    how='Newton equilibrium of the inactive element at the largest strain, Case I',
    needs=('2a',),
)
def strain_reproduced(figure: Data) -> Finding:
    """The inhomogeneous strain of the substrate is, effectively, reproduced in the
    metamaterial.
    """
    lag = figure['v_0'] - figure['V_0']
    lag = np.abs(lag - np.median(lag))
    inner, span = lag[20:-20], float(np.ptp(figure['V_0']))
    return Finding(
        verdict(bool(inner.max() < 0.02 * span)),
        f'v_0 and V_0 differ by at most {100 * inner.max() / span:.2f} % of the end displacement '
        f'({span:.2f} cells), {100 * lag.max() / span:.1f} % in the 20 cells at the free ends',
    )


@claim(
    place='p. 3, Eq. (3)',
    how='Eq. (3) against the held wall, 20 cells and more from the ends; without a constant',
    needs=('2a',),
)
def ansatz_against_held(figure: Data) -> Finding:
    """The analytical landscape stands for the simulated one."""
    X, difference = figure['X'], figure['ansatz'] - figure['held']
    inner = (X > 21.0) & (X < 180.0)
    worst = float(np.ptp(difference[:, inner], axis=1).max())
    scale = float(np.ptp(figure['held'][:, inner], axis=1).max())
    printed = figure['as_printed'] - figure['held']
    bad = float(np.ptp(printed[:, inner], axis=1).max())
    return Finding(
        verdict(worst < 0.05 * scale),
        f'the difference varies by {worst:.1e}, {100 * worst / scale:.1f} % of the range of U '
        f'({scale:.3f}). With psi(v) as printed, V_0 left out, it is {bad:.1e}. Within 20 cells '
        'of a free end the ansatz fails: a real wall is drawn out',
    )


@claim(
    place='p. 3, Fig. 2a',
    how=HELD,
    needs=('2a',),
)
def dip(figure: Data) -> Finding:
    """For no strain a pronounced decrease of U is centred at the soft defect."""
    (zero,) = np.flatnonzero(figure['strain'] == 0.0)
    depths, places = [], []
    for name in ('held', 'ansatz'):
        depth, place = _well(figure, figure[name][zero])
        depths.append(depth)
        places.append(place)
    holds = min(depths) > 1e-3 and all(abs(place - figure['defect']) <= 2.0 for place in places)
    return Finding(
        verdict(bool(holds)),
        f'a well {depths[0]:.2e} deep at X = {places[0]:.1f} (Eq. 3: {depths[1]:.2e} at '
        f'{places[1]:.1f})',
    )


@claim(
    place='p. 3, Fig. 2a',
    how=HELD,
    needs=('2a',),
)
def shallowing(figure: Data) -> Finding:
    """As |strain| increases, the defect energy well shallows."""
    strain = figure['strain']
    depth = np.array([_well(figure, U)[0] for U in figure['held']])
    order = np.argsort(np.abs(strain), kind='stable')
    falls = all(
        np.all(np.diff(depth[order][sign * strain[order] >= 0.0]) <= 1e-12) for sign in (-1, 1)
    )
    row = ', '.join(f'{1e3 * e:+.0f}: {1e3 * d:.2f}' for e, d in zip(strain, depth, strict=True))
    return Finding(verdict(bool(falls)), f'depth x 1e3 by strain x 1e3: {row}')


@claim(
    place='p. 4, Fig. 2a',
    how=HELD,
    needs=('2a',),
)
def extrema_at_s_min(figure: Data) -> Finding:
    """Under compression (tension) a local maximum (minimum) develops near s_min."""
    places = {
        name: (_extremum(figure, name, 0, -1.0), _extremum(figure, name, -1, 1.0))
        for name in ('held', 'ansatz')
    }
    site = float(figure['j_0'])
    holds = all(abs(place - site) <= 3.0 for pair in places.values() for place in pair)
    compressed, tense = places['held']
    return Finding(
        verdict(holds),
        f'at the largest strains the maximum is at X = {compressed:.1f} and the minimum at '
        f'{tense:.1f}; s_min is at {site:.0f}',
    )


@claim(
    place='p. 4 (not shown)',
    how='held wall in Case II, whose s_max lie inside (j = 42, 92 ...): where a wall strained '
    'to the peak of a write comes to rest',
    needs=('4a',),
)
def extrema_at_s_max(figure: Data) -> Finding:
    """The opposite effect manifests in the vicinity of s_max."""
    at_peak = _rest_under_strain(figure, -1.0)
    s_max = CASE_II.j_0 + CASE_II.J_s * (0.5 + np.arange(CASE_II.N // CASE_II.J_s))
    apart = np.array([np.abs(s_max - place).min() for place in at_peak])
    return Finding(
        verdict(bool(len(apart)) and bool(apart.max() < 2.0)),
        f'compressed walls are held at j = {", ".join(f"{x:.1f}" for x in at_peak)}: minima of U '
        f'within {apart.max():.1f} cells of s_max',
    )


@claim(
    place='p. 4, Fig. 2b.i',
    how='time integration with slowly growing strain; Newton continuation of the equilibrium',
    needs=('2b',),
)
def row_i(figure: Data) -> Finding:
    """The pinned wall de-pins, and is re-pinned at the strain-induced minimum or leaves (s_min
    before the defect).
    """
    return _column(figure, 0, re_pinned=-19.0, leaves='right')


@claim(
    place='p. 4, Fig. 2b.ii',
    how='as 2b.i',
    needs=('2b',),
)
def row_ii(figure: Data) -> Finding:
    """With s_min at the defect, de-pinning needs a significantly higher strain."""
    here = float(figure['static_compression_1'])
    others = [
        float(figure[f'static_{kind}_{n}']) for n in (0, 2) for kind in ('compression', 'tension')
    ]
    stays = bool(np.isnan(figure['static_tension_1']))
    ratio = here / max(others)
    return Finding(
        verdict(ratio > 1.5 and stays),
        f'compression of {1e3 * here:.2f}e-3, {ratio:.2f} to {here / min(others):.2f} times the '
        f'other four; under tension the minimum is on the defect, and the wall stays up to '
        f'{1e3 * float(figure["largest"]):.0f}e-3',
    )


@claim(
    place='p. 4, Fig. 2b.iii',
    how='as 2b.i',
    needs=('2b',),
)
def row_iii(figure: Data) -> Finding:
    """With s_min after the defect, the directions of de-pinning are exchanged."""
    return _column(figure, 2, re_pinned=19.0, leaves='left')


def _well(figure: Data, U: np.ndarray) -> tuple[float, float]:
    """Return depth and place of the well within 6 cells of the defect; depth 0 for none.

    The depth is from its bottom to the lower of its two rims within 20 cells.
    """
    X = figure['X']
    near = np.flatnonzero(np.abs(X - figure['defect']) <= 6.0)
    bottom = int(near[U[near].argmin()])
    left = U[np.flatnonzero((X[bottom] - 20.0 <= X) & (X[bottom] >= X))].max()
    right = U[np.flatnonzero((X[bottom] + 20.0 >= X) & (X[bottom] <= X))].max()
    if bottom in (near[0], near[-1]):
        return 0.0, float(X[bottom])
    return max(0.0, float(min(left, right) - U[bottom])), float(X[bottom])


def _extremum(figure: Data, name: str, row: int, sign: float) -> float:
    """Return where U has its greatest (sign -1) or least (1) value away from the ends."""
    X, U = figure['X'], sign * figure[name][row]
    inner = np.flatnonzero((X > 40.0) & (X < 160.0))
    return float(X[inner[U[inner].argmin()]])


def _column(figure: Data, number: int, re_pinned: float, leaves: str) -> Finding:
    squeezed, pulled = (figure[f'path_{kind}_{number}'] for kind in ('compression', 'tension'))
    gone = np.flatnonzero(np.isnan(squeezed))
    side = 'none' if not len(gone) else 'right' if squeezed[gone[0] - 1] > 0.0 else 'left'
    end = float(np.mean(pulled[-20:]))
    c, t = (1e3 * float(figure[f'static_{kind}_{number}']) for kind in ('compression', 'tension'))
    c_run, t_run = (
        1e3 * float(figure[f'depin_{kind}_{number}']) for kind in ('compression', 'tension')
    )
    return Finding(
        verdict(side == leaves and abs(end - re_pinned) < 1.0),
        f'compression of {c:.2f}e-3 drives it out at the {side} end; tension of {t:.2f}e-3 '
        f'takes it to x = {end:.1f}, where it is pinned again (time integration: {c_run:.2f}e-3 '
        f'and {t_run:.2f}e-3)',
    )


def _rest_under_strain(figure: Data, sign: float) -> np.ndarray:
    """Return where the wall is at the end of every hold at the peak of one sign."""
    strain = sign * figure['strain']
    peak = strain > 0.999 * strain.max()
    ends = np.flatnonzero(peak[:-1] & ~peak[1:])
    return np.asarray(figure['wall'][ends])
