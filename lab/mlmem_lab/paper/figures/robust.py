# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A film of an element of uneven parts that is written eight times by kicks."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mlmem import MemoryElement, Write, load_element
from mlmem.instrument.drivers import Simulation
from mlmem.physics import Scatter, scattered

from ...studies.trace import Trace, record_procedure
from ..figure import Data, Figure, Quality
from ..film import save_film

FIGURE = Figure('robust', 'A robust element of uneven parts, written eight times', seconds=10)

SHIPPED = load_element('robust_3')

SCATTER = 0.03
"""Standard deviation of on-site stiffness, springs and masses, relative."""

LEVEL_ORDER = (7, 0, 6, 1, 5, 2, 4, 3)
"""Levels in the order in which they are written: most are far from the one before."""


@FIGURE.register_data
def compute_data(quality: Quality) -> Data:
    """Return frames of the configuration and the left end while the levels are written."""
    made = scattered(SHIPPED.design, Scatter(alpha=SCATTER, k_r=SCATTER, mass=SCATTER), 1)
    driver = Simulation.of(made, SHIPPED.settings.time)
    element, trace = MemoryElement(SHIPPED, driver=driver), Trace()
    captions: list[str] = []
    for level in LEVEL_ORDER[: quality.pick(2, len(LEVEL_ORDER))]:
        record_procedure(element, Write(level), trace)
        captions += [f'write level {level}'] * (len(trace.t) - len(captions))
    frames = np.linspace(0, len(trace.t) - 1, quality.pick(8, 120)).astype(int)
    return {
        't': np.array(trace.t)[frames],
        'field': np.array(trace.configuration, dtype=np.float32)[frames],
        'caption': np.array(captions)[frames],
        'success': [outcome.success for outcome in trace.outcomes],
    }


@FIGURE.register_film
def save_movie(data: Data, stem: Path) -> list[Path]:
    """Write the film over the motion of the left end; return the file."""
    return save_film(SHIPPED.design, data, data['field'][:, 0], 'left end', stem)
