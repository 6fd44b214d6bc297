# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The device's procedures, as sequences that the tick loop advances.

A procedure is a generator: what it does before a `yield` takes effect in the following tick. It
yields the number of ticks after which to resume it. Resumed earlier, it does nothing but yield
the remaining number. It never sleeps or reads a clock. It knows only what the device can measure,
the displacements of the two ends, and never the true wall position.
"""

from collections.abc import Callable
from functools import cache
from importlib import import_module

from ..commands import Outcome
from ..instrument.blocks import Procedure, run
from ..procedure_table import PROCEDURES
from . import estimates

__all__ = ['Procedure', 'find_steps', 'run']


@cache
def find_steps(name: str) -> tuple[Callable[..., Procedure[Outcome]], Callable[..., float]]:
    """Return how a procedure of the table is done: what begins its generator, and what estimates
    how long it will take, in time units.

    Both take the element and the arguments of its command.
    """
    row = PROCEDURES[name]
    module, _, begin = row.steps.partition('.')
    steps = import_module(f'{__name__}.{module}')
    return getattr(steps, begin), getattr(estimates, row.expected)


for _name in ('write', 'read', 'erase', 'abort'):  # or the first of them would wait for an import
    find_steps(_name)
