# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A film of kicks: every level of Case II written without strain, then erased."""

from __future__ import annotations

from pathlib import Path

from ..figure import Data, Figure, Quality
from . import kicked
from .mov_s1 import save_film

FIGURE = Figure('kicks', 'Film: eight kicks, each after one that erases', seconds=30)


@FIGURE.data
def compute_data(quality: Quality) -> Data:
    """Return the frames of `kicked`."""
    return kicked.compute_data(quality)


@FIGURE.film
def save_movie(data: Data, stem: Path) -> list[Path]:
    """Write the cells over the place of the wall; return the file."""
    return [save_film(data, data['path'], 'wall at $j$', stem)]
