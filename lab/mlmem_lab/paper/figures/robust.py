# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A film of an element of uneven parts that is written eight times by kicks."""

from __future__ import annotations

from pathlib import Path

from mlmem import MemoryElement, Write, load_element
from mlmem.instrument.drivers import Simulation
from mlmem.physics import Scatter, scattered

from ...studies.trace import record_procedures
from ..figure import Data, Figure, Quality
from ..film import save_film

definition = Figure('robust', 'A robust element of uneven parts, written eight times', seconds=10)

SHIPPED = load_element('robust_3')

SCATTER = 0.03
"""Standard deviation of on-site stiffness, springs and masses, relative."""

LEVEL_ORDER = (7, 0, 6, 1, 5, 2, 4, 3)
"""Levels in the order in which they are written: most are far from the one before."""


@definition.register_data
def compute_data(quality: Quality) -> Data:
    """Return frames of the configuration and the left end while the levels are written."""
    made = scattered(SHIPPED.design, Scatter(alpha=SCATTER, k_r=SCATTER, mass=SCATTER), 1)
    driver = Simulation.of(made, SHIPPED.settings.time)
    levels = LEVEL_ORDER[: quality.pick(2, len(LEVEL_ORDER))]
    commands = [(f'write level {level}', Write(level)) for level in levels]
    element = MemoryElement(SHIPPED, driver=driver)
    return record_procedures(element, commands).list_frames(quality.pick(8, 120))


@definition.register_film
def save_movie(data: Data, stem: Path) -> list[Path]:
    """Write the film over the motion of the left end; return the file."""
    return save_film(SHIPPED.design, data, data['field'][:, 0], 'left end', stem)
