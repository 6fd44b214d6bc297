# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Ours: the independent check, every quantity by a second route that shares no code with it.

SciPy's DOP853 on the equations as printed, closed forms, the continuum's wall and minimisers:
see `second_route`.
"""

from __future__ import annotations

import numpy as np

from ..figure import Data, Figure, Judged, Quality, judged
from ..second_route import statics

FIGURE = Figure(
    'check',
    'The independent check: SciPy, closed forms, Newton',
    seconds=15,
)


@FIGURE.data
def compute(quality: Quality) -> Data:
    """Return the table, and two histories by both routes: a write's wall and an echo."""
    data: Data = {}
    rows = [
        *statics.potential(),
        *statics.waves(quality),
        *statics.continuum(),
        statics.kink_fit(quality),
        *statics.static(quality),
        *statics.dynamics(quality, data),
    ]
    data['quantity'] = np.array([row.quantity for row in rows])
    data['ours'] = np.array([row.ours for row in rows])
    data['theirs'] = np.array([row.theirs for row in rows])
    data['route'] = np.array([row.route for row in rows])
    return data


@FIGURE.claim(
    'Eq. (1) is integrated by the scheme of Noh and Bathe',
    page=5,
    how='kernel against SciPy DOP853 over a whole write cycle and an echo',
)
def _integrator(data: Data) -> Judged:
    rows = {
        str(name): (float(ours), float(theirs))
        for name, ours, theirs in zip(data['quantity'], data['ours'], data['theirs'], strict=True)
    }
    place = abs(np.subtract(*rows['wall at the end of the schedule']))
    delay = abs(np.subtract(*rows['echo delay, wall at j = 50']))
    coarse = rows['greatest v_c of the echo x 1e3']
    fine = rows['greatest v_c x 1e3, a tenth of the step']
    loss, remaining = (100.0 * abs(ours / theirs - 1.0) for ours, theirs in (coarse, fine))
    return judged(
        place < 0.01 and delay < 2.0 and remaining < 1.0,
        f'the wall ends within {place:.1e} cells, the echo is {delay:.2f} late. At our step of '
        f'0.25 the scheme damps the echo by {loss:.0f} %; at a tenth of it by {remaining:.2f} %',
    )
