# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem doctor --warm`: do the work of a first start now, and cache it."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

Step = tuple[str, Callable[[], object]]
"""A description, and the function that does it."""


def warm(aside: bool) -> float:
    """Compile the kernels that a node needs and check the presets, with a progress bar.

    Args:
        aside: Whether the bar goes to the standard error stream.

    Returns:
        How long it took in seconds.
    """
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    from .console import plain_console

    begun, all_steps = time.monotonic(), list(steps())
    columns = TextColumn('{task.description:<44}'), BarColumn(), TimeRemainingColumn()
    with Progress(*columns, console=plain_console(aside)) as bar:
        task = bar.add_task('', total=len(all_steps))
        for name, step in all_steps:
            bar.update(task, description=name)
            step()
            bar.advance(task)
    return time.monotonic() - begun


def steps() -> Iterator[Step]:
    """Yield the jobs: kernels first, as the checks run them."""
    from ..device.presets import PRESETS
    from ..host.design_check import findings
    from ..physics import CASE_II, INTEGRATORS, Chain

    for name, integrator in INTEGRATORS.items():
        for substrate in ('rigid', 'elastic'):
            chain = Chain(replace(CASE_II, substrate=substrate), integrator=integrator)
            yield f'kernel {name}, {substrate} substrate', partial(chain.rest, 1)
    for name, preset in PRESETS.items():
        yield f'design check of {name}', partial(findings, preset.design, preset.settings)
