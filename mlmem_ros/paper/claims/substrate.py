# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Claims about the substrate's rigidity (pages 2 and 3), and the integrator's."""

from __future__ import annotations

import numpy as np

from ..figure import Data
from .claim import Finding, collector, verdict

CLAIMS, claim = collector()


@claim(
    place='p. 2',
    how='a cycle from every level, with Eqs. (1a, b) and with (1a) alone',
    needs=('rigidity',),
)
def rigid_suffices(study: Data) -> Finding:
    """A substrate that is, effectively, rigid allows Eq. (1a) alone."""
    row = int(np.argmin(np.abs(study['s_min'] - 1000.0)))
    moved, apart = study['moved'][row], study['difference'][row]
    return Finding(
        verdict(bool(np.all(moved == 1.0)) and bool(apart.max() < 0.5)),
        f'at s_min = 1000 both move the wall by one level from each of {moved.size} levels; '
        f'the walls end within {apart.max():.2f} cells of each other at the end of the cycle, and '
        f'within {study["difference"][-1].max():.1e} at s_min = {study["s_min"][-1]:.0f}',
    )


@claim(
    place='p. 2',
    how='sweep of s_min with s_max = 3 s_min',
    needs=('rigidity',),
)
def how_rigid(study: Data) -> Finding:
    """Proper function requires min(s) >> max(k_r, k_s); no number is printed."""
    good = np.all(study['moved'] == 1.0, axis=1)
    listed = '; '.join(
        f'{s:.0f}: {"all steps" if ok else "fails"}'
        for s, ok in zip(study['s_min'], good, strict=True)
    )
    required = bool(good[-1]) and not good.all() and bool(np.all(np.diff(good.astype(int)) >= 0))
    return Finding(
        verdict(required, in_part=bool(good[-1])),
        f's_min by what one cycle does: {listed}. At {study["s_min"][0]:.0f}, '
        f'{int(np.sum(study["moved"][0] == 1.0))} of {study["moved"].shape[1]} steps are made. '
        'The substrate gives way under the wall and traps it where the gradient alone would '
        'move it',
    )


@claim(
    place='p. 2',
    how='the same pulse and wall with Eqs. (1a, b) and with (1a) alone, the same step',
    needs=('rigidity',),
)
def low_frequency(study: Data) -> Finding:
    """At low frequency the metamaterial may be treated in isolation."""
    row = int(np.argmin(np.abs(study['s_min'] - 1000.0)))
    apart = float(np.abs(np.diff(study['delay'][row]))[0])
    return Finding(
        verdict(bool(study['echo'][row] < 0.05) and apart < 5.0),
        f'at s_min = 1000 v_1 differs by {100 * study["echo"][row]:.1f} % of the pulse, and the '
        f"echo's delay by {apart:.2f}",
    )


@claim(
    place='p. 5',
    how='kernel against SciPy DOP853 over a whole write cycle and an echo',
    needs=('check',),
)
def integrator(study: Data) -> Finding:
    """Eq. (1) is integrated by the scheme of Noh and Bathe."""
    rows = {
        str(name): (float(ours), float(theirs))
        for name, ours, theirs in zip(
            study['quantity'], study['ours'], study['theirs'], strict=True
        )
    }
    place = abs(np.subtract(*rows['wall at the end of the schedule']))
    delay = abs(np.subtract(*rows['echo delay, wall at j = 50']))
    coarse = rows['greatest v_c of the echo x 1e3']
    fine = rows['greatest v_c x 1e3, a tenth of the step']
    loss, left = (100.0 * abs(ours / theirs - 1.0) for ours, theirs in (coarse, fine))
    return Finding(
        verdict(place < 0.01 and delay < 2.0 and left < 1.0),
        f'the wall ends within {place:.1e} cells, the echo is {delay:.2f} late. At our step of '
        f'0.25 the scheme damps the echo by {loss:.0f} %; at a tenth of it by {left:.2f} %',
    )
