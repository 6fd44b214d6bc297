# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A progress bar with the time left, for work that takes longer than two seconds."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterable, Iterator
from typing import TypeVar

Item = TypeVar('Item')


def track_progress(items: Iterable[Item], total: int, description: str) -> Iterator[Item]:
    """Yield items and show how far they have got; silently where rich is not installed.

    Args:
        items: What is worked through.
        total: Number of items.
        description: Text in front of the bar.
    """
    try:
        from rich.console import Console
        from rich.progress import Progress
    except ImportError:
        yield from items
        return
    start, bar, task = time.monotonic(), None, None
    with contextlib.ExitStack() as stack:
        for done, item in enumerate(items):
            # no bar for short work
            if bar is None and time.monotonic() - start > 2.0:
                bar = stack.enter_context(Progress(console=Console(stderr=True), transient=True))
                task = bar.add_task(description, total=total)
            if bar is not None and task is not None:
                bar.update(task, completed=done)
            yield item
