# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Making figures side by side, one process each."""

from __future__ import annotations

import multiprocessing
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path

from .figure import Figure, Quality
from .gallery import BY_NAME

FOLDER = 'figures'
"""Folder of the files below the output folder."""


@dataclass(frozen=True)
class Done:
    """A finished figure: its name, the files it wrote, and how long it took in seconds."""

    name: str
    files: tuple[Path, ...]
    seconds: float


def run_one(name: str, quality: Quality, output: Path) -> Done:
    """Compute, draw and save one figure.

    Args:
        name: Its name in the gallery.
        quality: How much is computed.
        output: Folder below which the files go; it is made.
    """
    began = time.monotonic()
    folder = output / FOLDER
    folder.mkdir(parents=True, exist_ok=True)
    figure = BY_NAME[name]
    files = figure.save(figure.compute(quality), folder)
    return Done(name, tuple(files), time.monotonic() - began)


def run(figures: Sequence[Figure], quality: Quality, output: Path, jobs: int) -> Iterator[Done]:
    """Make figures in processes of their own, the longest first; yield them as they end.

    Args:
        figures: What to make.
        quality: How much is computed.
        output: Folder below which the files go.
        jobs: How many run at once; 1 runs them in this process.
    """
    order = sorted(figures, key=lambda figure: -figure.seconds)
    if jobs == 1 or len(order) == 1:
        for figure in order:
            yield run_one(figure.name, quality, output)
        return
    # Spawned, not forked: a forked child could inherit a lock that numba holds.
    context = multiprocessing.get_context('spawn')
    with ProcessPoolExecutor(min(jobs, len(order)), mp_context=context) as pool:
        futures = [pool.submit(run_one, figure.name, quality, output) for figure in order]
        try:
            for future in as_completed(futures):
                yield future.result()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
