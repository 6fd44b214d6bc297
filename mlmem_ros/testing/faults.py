# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Faults for the duration of a block."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from .running import RunningNode


@contextmanager
def faults(node: RunningNode, **given: bool | int | float) -> Iterator[None]:
    """Set faults of an element, named like the parameters `faults.*`, and restore them at the end,
    even after an exception.

    ::

        with faults(node, actuator_stuck=True), pytest.raises(RequestFailed):
            node.memory.write(3).wait()

    Commands sent in the block meet the faults; those sent afterwards do not.

    Raises:
        RequestRefused: There is no such fault, or the element cannot have it.
    """
    named = {f'faults.{name}': value for name, value in given.items()}
    before = node.memory.parameters(*named).wait()
    try:
        node.memory.set_parameters(named).wait()
        yield
    finally:
        if node.running:
            node.memory.set_parameters(before).wait()
