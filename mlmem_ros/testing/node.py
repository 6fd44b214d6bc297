# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A memory node for the duration of a test, in the test's process or in its own."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from os import PathLike

from ..ros.node_process import Parameters, node_arguments
from .running import RunningNode


@contextmanager
def memory_node(
    parameters: Parameters | None = None,
    *,
    name: str = 'mlmem',
    namespace: str = '',
    file: str | PathLike[str] | None = None,
    options: Sequence[str] = (),
    apart: bool = False,
) -> Iterator[RunningNode]:
    """Run a memory node until the end of the context.

    ::

        with memory_node({'scale.time': 1e-5}) as node:
            assert node.memory.write(5).wait().level == 5

    It joins the ROS graph like any node, in the environment's ROS_DOMAIN_ID: set one that no robot
    uses. In the test's own process it starts in less than a second.

    Args:
        parameters: Parameters by name.
        name: Name of the node.
        namespace: Its namespace.
        file: A parameter file.
        options: Further command line arguments, plain options first.
        apart: Run it in a process of its own, which can take signals and crash; that takes some
            seconds to start.

    Yields:
        A `RunningNode`; one apart also has `signal(number)`.

    Raises:
        Exception: Whatever keeps the node from starting. One apart raises nothing: see its output
            and exit status.
    """
    element = f'{namespace.rstrip("/")}/{name}'
    command = node_arguments(element, parameters, file)
    if apart:
        from .apart import NodeApart

        with NodeApart(element, [*options, *command]) as node:
            yield node
    else:
        from .here import NodeHere

        with NodeHere(element, ['memory_node', *options, *command]) as node:
            yield node
