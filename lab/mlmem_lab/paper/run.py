# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Making a figure, in whichever process."""

from __future__ import annotations

from pathlib import Path

from .figure import Quality
from .gallery import BY_NAME

FOLDER = 'figures'
"""Folder of the files below the output folder."""


def run_one(name: str, quality: Quality, output: Path) -> dict[str, list[Path]]:
    """Compute, draw and save one figure; return the files by its name.

    The folder below which they go is made.
    """
    folder = output / FOLDER
    folder.mkdir(parents=True, exist_ok=True)
    figure = BY_NAME[name]
    return {name: figure.save(figure.compute(quality), folder)}
