# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A film of an element of uneven parts that is written eight times by kicks."""

from __future__ import annotations

from pathlib import Path

from mlmem import MemoryElement, Write, load_element
from mlmem.instrument.drivers import Simulation
from mlmem.physics import Scatter, draw_specimen

from ...studies.trace import record_procedures
from ..figure import Data, Figure, Quality
from ..film import save_film

definition = Figure('robust', 'A robust element of uneven parts, written eight times', seconds=10)


@definition.register_data
def compute_data(quality: Quality) -> Data:
    """Return frames of the configuration and the left end while the levels are written."""
    shipped = load_element('robust_3')
    made = draw_specimen(shipped.design, Scatter(alpha=0.03, k_r=0.03, mass=0.03), 1)
    driver = Simulation.build_blank(made, shipped.settings.time)
    level_order = 7, 0, 6, 1, 5, 2, 4, 3  # most are far from the one before
    levels = level_order[: quality.pick(2, len(level_order))]
    commands = [(f'write level {level}', Write(level)) for level in levels]
    element = MemoryElement(shipped, driver=driver)
    return record_procedures(element, commands).list_frames(quality.pick(8, 120))


@definition.register_film
def save_movie(data: Data, stem: Path) -> list[Path]:
    """Write the film over the motion of the left end; return the file."""
    design = load_element('robust_3').design
    return save_film(design, data, data['field'][:, 0], 'left end', stem)
