# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Claims about small waves and the echo (Figs. 3 and 4b, pages 4 to 6)."""

from __future__ import annotations

import numpy as np

from ..figure import Data
from .claim import Finding, collector, verdict

CLAIMS, claim = collector()


@claim(
    place='p. 5, Fig. 3a',
    how='Eq. (4) with Table I, Case II; eigenvalues of a ring of cells beside it',
    needs=('3a',),
)
def bands(figure: Data) -> Finding:
    """The propagating modes of the two phases have non-overlapping frequency ranges."""
    (low_1, high_1), (low_2, high_2) = figure['bands']
    return Finding(
        verdict(low_2 > high_1, in_part=high_2 > high_1 and low_1 < low_2),
        f's1: {low_1:.4f} to {high_1:.4f}, s2: {low_2:.4f} to {high_2:.4f}. They share '
        f'{low_2:.3f} to {high_1:.3f}; only {low_1:.3f} to {low_2:.3f} belongs to s1 alone and '
        f'{high_1:.3f} to {high_2:.3f} to s2 alone. Disjoint bands need d > '
        f'{float(figure["d_disjoint"]):.3f}, not 0.0380',
    )


@claim(
    place='p. 5',
    how='Eq. (4), and a sweep of carriers in the simulated element',
    needs=('3a', 'carriers'),
)
def printed_carrier(figure: Data, sweep: Data) -> Finding:
    """The carrier lies within the band of the active phase: omega_c = 2.4."""
    edge = float(figure['bands'][1, 1])
    omega = sweep['omega_left']
    at = int(np.argmin(np.abs(omega - 2.4)))
    echo, quiet = float(sweep['echo_left'][at].max()), float(sweep['quiet_left'][at])
    inside = int(np.argmin(np.abs(omega - 2.0)))
    heard = int(np.count_nonzero(sweep['echo_left'][at] > quiet))
    return Finding(
        verdict(edge > 2.4),
        f'2.4 is above both bands (s2 ends at {edge:.4f}). At best {echo:.1e} comes back, from '
        f'level 0; {heard} of {len(sweep["levels"])} levels are above the ring-down of '
        f'{quiet:.1e}. A carrier of 2.0 brings back at least '
        f'{float(sweep["echo_left"][inside].min()):.1e} from every level',
    )


@claim(
    place='p. 5, Fig. 3b',
    how='peak of v_c with the printed pulse, A = 0.01',
    needs=('3b',),
)
def printed_threshold(figure: Data) -> Finding:
    """An echo is v_c > 7.5e-3 after the pulse."""
    pulse = max(float(figure[f'pulse_v_c_{name}_1']) for name in ('ours', 'printed'))
    printed = float(figure['v_th_printed'])
    return Finding(
        verdict(pulse > printed and not np.isnan(figure['delay_printed_1'])),
        f'the pulse itself reaches v_c = {pulse:.1e} only: nothing can cross {printed:.1e}. '
        f'7.5e-5 works (`one_threshold`)',
    )


@claim(
    place='p. 5',
    how='sweep of carriers and thresholds: delays of all eight levels in order and 20 apart',
    needs=('carriers',),
)
def one_threshold(sweep: Data) -> Finding:
    """One threshold of v_c tells the echoes of all levels."""
    omega, plain, gained = (sweep[f'{name}_left'] for name in ('omega', 'plain', 'compensated'))
    works = omega[~np.isnan(plain[:, 0])]
    if not len(works):
        return Finding(verdict(False), 'no carrier has one')
    at, beyond = (int(np.argmin(np.abs(omega - value))) for value in (2.0, 2.1))
    low, high = plain[at]
    inside = bool(low < 7.5e-5 < high)
    return Finding(
        verdict(inside and bool(np.isnan(plain[omega == 2.4]).all())),
        f'from the left with a plain threshold for carriers {works.min():.2f} to '
        f'{works.max():.2f}; at 2.0 from {low:.1e} to {high:.1e}, which holds 7.5e-5: so we read '
        f'the printed "2.4, 7.5e-3" as 2.0, 7.5e-5. At 2.1, where s1 does not propagate, the '
        f'ring-down of the pulse hides the far echoes from a plain threshold; times '
        f'exp(-eta t/2), as in our device, {gained[beyond][0]:.1e} to {gained[beyond][1]:.1e} '
        'works',
    )


@claim(
    place='p. 5',
    how='the same probe of an element without a wall, too long to echo from its far end',
    needs=('4b',),
)
def echo_from_wall(figure: Data) -> Finding:
    """At the domain wall the wave is reflected back toward the source as an echo."""
    silent = bool(np.isnan(figure['delay_without_wall']))
    heard = not np.isnan(figure['delay_paper']).any()
    margin = float(figure['margin_without_wall'])
    return Finding(
        verdict(silent and heard),
        f'without a wall v_c stays at {margin:.2f} of the threshold after the pulse; with one '
        f'it reaches {figure["margin_paper"].min():.1f} to {figure["margin_paper"].max():.1f}',
    )


@claim(
    place='p. 5, Fig. 3b',
    how='N = 200, carrier 2.0, threshold 7.5e-5',
    needs=('3b',),
)
def delay_grows(figure: Data) -> Finding:
    """The delay grows with the distance of the wall (Fig. 3b: j = 51 and 101)."""
    near, far = float(figure['delay_ours_0']), float(figure['delay_ours_1'])
    return Finding(
        verdict(far > near + 50.0),
        f'delays {near:.1f} and {far:.1f}: {100.0 / (far - near):.3f} cells per time unit',
    )


@claim(
    place='p. 6, Fig. 4b',
    how='wall at rest at every defect, probed from the left; our device, and the right end, '
    'beside it',
    needs=('4b',),
)
def delays_by_level(figure: Data) -> Finding:
    """The delays of the eight levels are distinct and increase with the level."""
    steps = [np.diff(figure[f'delay_{name}']) for name in ('paper', 'left')]
    right = -np.diff(figure['delay_right'])
    holds = all(bool(np.all(step > 20.0)) for step in steps)
    listed = ', '.join(f'{delay:.1f}' for delay in figure['delay_paper'])
    return Finding(
        verdict(holds),
        f'{listed}; at least {steps[0].min():.0f} apart (device: {steps[1].min():.0f}; right '
        f'end, falling with the level: {right.min():.0f})',
    )


@claim(
    place='p. 3',
    how='wall at rest at every defect, probed from the right with a carrier of 0.7, inside the '
    'band of s1 and below that of s2',
    needs=('4b', 'carriers'),
)
def either_boundary(figure: Data, sweep: Data) -> Finding:
    """The position may be determined by a signal initiated at either boundary."""
    falls = -np.diff(figure['delay_right'])
    at = [
        int(np.argmin(np.abs(sweep[f'omega_{e}'] - o))) for e, o in (('left', 2), ('right', 0.7))
    ]
    left, right = sweep['echo_left'][at[0]], sweep['echo_right'][at[1]]
    return Finding(
        verdict(bool(np.all(falls > 0.0))),
        f'from the right the delays fall from {figure["delay_right"][0]:.0f} to '
        f'{figure["delay_right"][-1]:.0f}, and the weakest echo is {right.min() / left.min():.0f} '
        'times stronger than from the left',
    )


@claim(
    place='p. 5 (implied), Eq. (4)',
    how='straight line through the delays against 2 / v_g(omega_c)',
    needs=('4b',),
)
def time_of_flight(figure: Data) -> Finding:
    """Time of flight over distance is the group velocity of the carrier."""
    ratios = {}
    for name in ('paper', 'right'):
        levels = figure['levels']
        slope = np.polyfit(levels, figure[f'delay_{name}'], 1)[0]
        ratios[name] = slope / np.polyfit(levels, figure[f'time_of_flight_{name}'], 1)[0]
    right = abs(ratios['right'] - 1.0) < 0.1
    left = abs(ratios['paper'] - 1.0) < 0.1
    return Finding(
        verdict(right and left, in_part=right),
        f'right end (0.7): delays grow by {ratios["right"]:.3f} of what Eq. (4) says. Left end '
        f'(2.0): by {ratios["paper"]:.3f}, because near the band edge the slower carrier is '
        'overtaken by the lower frequencies of the pulse, which cross the threshold first',
    )
