# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Faults for the length of a block."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from .running import RunningNode


@contextmanager
def faults(node: RunningNode, **given: bool | int | float) -> Iterator[None]:
    """Give an element faults, and remove them at the end, whatever happened meanwhile.

    ::

        with faults(node, actuator_stuck=True), pytest.raises(RequestRefused):
            node.memory.write(3).wait()

    Every command sent within meets them, and none sent afterwards.

    Args:
        node: Whose element.
        given: Faults by name, like the parameters `faults.*`.

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
