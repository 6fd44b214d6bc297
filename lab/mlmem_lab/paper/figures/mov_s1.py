# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Mov. S1: the walls moving under strain: write level 0 to 7, then erase."""

from __future__ import annotations

from pathlib import Path

from mlmem import Command, Erase, MemoryElement, Write
from mlmem.physics import CASE_II

from ...studies import style
from ...studies.trace import record_procedures
from ..figure import Data, Figure, Quality
from ..film import save_film

definition = Figure('s1', 'Mov. S1: the walls moving under strain', seconds=13)


@definition.register_data
def compute_data(quality: Quality) -> Data:
    """Return frames of configuration and strain while every level is written and erased."""
    levels = range(quality.pick(2, CASE_II.levels))
    commands: list[tuple[str, Command]] = [
        (f'write level {level}  ({CASE_II.code(level)})', Write(level)) for level in levels
    ]
    commands.append(('erase: a kink meets the wall', Erase()))
    return record_procedures(MemoryElement(CASE_II), commands).list_frames(quality.pick(8, 140))


@definition.register_film
def save_movie(data: Data, stem: Path) -> list[Path]:
    """Write the film over the strain; return the file."""
    return save_film(CASE_II, data, 1e3 * data['strain'], style.Label.STRAIN, stem)
