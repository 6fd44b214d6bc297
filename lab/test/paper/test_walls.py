# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a wall reflects of small waves, beside the kernel."""

import dataclasses

import numpy as np
import pytest

from mlmem import preset
from mlmem.physics import PEFRL, Chain, HeldCell, Specimen, substep_times
from mlmem.readers.register import pin_walls
from mlmem_lab.paper.figures.walls import CELLS_AROUND_WALL, compute_reflectivity

LOOK, SIGMA, DT, EVERY = 70, 16.0, 0.1, 4


@pytest.mark.parametrize(
    ('carrier', 'between', 'until'), [(1.68, 280.0, 500.0), (1.85, 360.0, 630.0)]
)
def test_a_wall_reflects_what_its_matrices_say(carrier, between, until):
    """A pulse of 1e-4 passes cell 70 and comes back from the wall in cell 125, before it does from
    the ends. No other cell is a defect, and nothing damps.

    The spectrum of what comes back over that of what went there, at the carrier: within 2 %, for
    the end of one and the begin of the other overlap by little.
    """
    design = dataclasses.replace(preset('byte').design, eta=0.0)
    site = design.defect_site(4)
    away = np.abs(design.sites - site) >= CELLS_AROUND_WALL
    made = Specimen(design, alpha_factor=np.where(away, design.alpha[site] / design.alpha, 1.0))
    v = pin_walls(made, [4])
    chain = Chain(design, DT, PEFRL)
    chain.set_specimen(made)
    chain.place(v)
    middle = 6.0 * SIGMA
    t = substep_times(round(2.0 * middle / DT), DT, PEFRL)
    envelope = 1e-4 * np.exp(-0.5 * ((t - middle) / SIGMA) ** 2)
    sine, cosine = np.sin(carrier * t), carrier * np.cos(carrier * t)
    motion = np.array([v[0] + envelope * sine, 0.0 * t])
    motion[1] = envelope * (cosine - (t - middle) / SIGMA**2 * sine)
    heard, n = [], EVERY * PEFRL.substeps
    for k in range(round(until / DT / EVERY)):
        held = motion[:, n * k : n * (k + 1)]
        chain.advance(np.zeros(n), HeldCell(1, held) if held.size else None)
        heard.append(chain.v[LOOK - 1] - v[LOOK - 1])
    time = EVERY * DT * np.arange(1.0, len(heard) + 1.0)
    tone = np.array(heard) * np.exp(-1j * carrier * time)
    away, back = (abs(tone[which].sum()) for which in (time < between, time >= between))
    (expected,) = compute_reflectivity(
        made, v, np.array([carrier]), site - CELLS_AROUND_WALL, site + CELLS_AROUND_WALL
    )
    assert back / away == pytest.approx(expected, rel=0.02)
