# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Making figures side by side."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import as_completed
from pathlib import Path

from ..studies.campaign import workers
from .figure import Figure, Quality
from .gallery import BY_NAME

FOLDER = 'figures'
"""Folder of the files below the output folder."""


def run_one(name: str, quality: Quality, output: Path) -> dict[str, list[Path]]:
    """Compute, draw and save one figure; return the files by its name.

    Args:
        name: Its name in the gallery.
        quality: How much is computed.
        output: Folder below which the files go; it is made.
    """
    folder = output / FOLDER
    folder.mkdir(parents=True, exist_ok=True)
    figure = BY_NAME[name]
    return {name: figure.save(figure.compute(quality), folder)}


def run(
    figures: Sequence[Figure], quality: Quality, output: Path, jobs: int
) -> Iterator[dict[str, list[Path]]]:
    """Make figures side by side, the longest first; yield files by name as they are done.

    Args:
        figures: What to make.
        quality: How much is computed.
        output: Folder below which the files go.
        jobs: How many run at once; 1 runs them in this process.
    """
    order = sorted(figures, key=lambda figure: -figure.seconds)
    with workers(min(jobs, len(order))) as pool:
        if pool is None:
            for figure in order:
                yield run_one(figure.name, quality, output)
        else:
            futures = [pool.submit(run_one, figure.name, quality, output) for figure in order]
            for future in as_completed(futures):
                yield future.result()
