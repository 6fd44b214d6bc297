# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Running studies side by side, one process each."""

from __future__ import annotations

import multiprocessing
import os
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path

from .figure import Quality, Study
from .registry import BY_NAME

FIGURES = 'figures'
"""Folder of the files below the output folder."""


@dataclass(frozen=True)
class Done:
    """A finished study: its name, the files it wrote, and how long it took in seconds."""

    name: str
    files: tuple[Path, ...]
    seconds: float


def cores() -> int:
    """Return how many cores this process may use."""
    if hasattr(os, 'sched_getaffinity'):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def run_one(name: str, quality: Quality, output: Path) -> Done:
    """Compute, draw and save one study.

    Args:
        name: Its name in the registry.
        quality: How much is computed.
        output: Folder below which the files go; it is made.
    """
    began = time.monotonic()
    folder = output / FIGURES
    folder.mkdir(parents=True, exist_ok=True)
    study = BY_NAME[name]
    files = study.save(study.compute(quality), folder)
    return Done(name, tuple(files), time.monotonic() - began)


def run(studies: Sequence[Study], quality: Quality, output: Path, jobs: int) -> Iterator[Done]:
    """Run studies in processes of their own, the longest first; yield them as they end.

    Args:
        studies: What to run.
        quality: How much is computed.
        output: Folder below which the files go.
        jobs: How many run at once; 1 runs them in this process.
    """
    order = sorted(studies, key=lambda study: -study.seconds)
    if jobs == 1 or len(order) == 1:
        for study in order:
            yield run_one(study.name, quality, output)
        return
    # Spawned, not forked: a forked child could inherit a lock that numba holds.
    context = multiprocessing.get_context('spawn')
    with ProcessPoolExecutor(min(jobs, len(order)), mp_context=context) as pool:
        futures = [pool.submit(run_one, study.name, quality, output) for study in order]
        try:
            for future in as_completed(futures):
                yield future.result()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
