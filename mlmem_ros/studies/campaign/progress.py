# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Progress of a campaign and its remaining time, in the terminal."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from .campaign import Row

SPEED_PERIOD = 120.0
"""Seconds over which speed is averaged for the remaining time."""


def with_progress(
    console: Console, rows: Iterable[Row], done: int, total: int | None, what: str = 'points'
) -> Iterator[Row]:
    """Yield rows, and show their number, the elapsed and the remaining time.

    Args:
        console: Where to.
        rows: What `run` yields.
        done: How many the ledger held before.
        total: How many there will be; None if not known yet.
        what: What they are.
    """
    columns = (
        TextColumn(what), MofNCompleteColumn(), BarColumn(), TimeElapsedColumn(),
        TextColumn('left'), TimeRemainingColumn(elapsed_when_finished=False),
    )  # fmt: skip
    with Progress(*columns, console=console, speed_estimate_period=SPEED_PERIOD) as progress:
        task = progress.add_task(what, total=total, completed=done)
        for row in rows:
            progress.advance(task)
            yield row
