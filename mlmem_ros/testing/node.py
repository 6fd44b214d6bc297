# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A memory node for the length of a test, in the test's own process or in one of its own."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from os import PathLike

from .running import RunningNode

Parameters = Mapping[str, bool | int | float | str]


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

    It is in the ROS graph as any node is, under the environment's ROS_DOMAIN_ID: set one that no
    robot has. In the test's own process it is there in a tenth of a second.

    Args:
        parameters: Parameters by name.
        name: Name of the node.
        namespace: Its namespace.
        file: A parameter file.
        options: More of the command line, plain options first.
        apart: Run it as a process of its own, which a signal can reach and a crash can end;
            it takes some seconds to start.

    Yields:
        A `RunningNode`; the one apart has `signal(number)`, too.

    Raises:
        Whatever `memory_node` cannot start for; of the one apart its output and exit status tell.
    """
    command = ros_arguments(parameters or {}, name, namespace, file)
    element = f'{namespace.rstrip("/")}/{name}'
    if apart:
        from .apart import NodeApart

        with NodeApart(element, [*options, *command]) as node:
            yield node
    else:
        from .here import NodeHere

        with NodeHere(element, ['memory_node', *options, *command]) as node:
            yield node


def ros_arguments(
    parameters: Parameters, name: str, namespace: str, file: str | PathLike[str] | None
) -> list[str]:
    """Return what the ROS command line says of a node."""
    given = [f'{key}:={_literal(value)}' for key, value in parameters.items()]
    remaps = [f'__node:={name}', *([f'__ns:={namespace}'] if namespace else [])]
    return [
        '--ros-args',
        *(('--params-file', str(file)) if file is not None else ()),
        *(word for each in given for word in ('-p', each)),
        *(word for each in remaps for word in ('-r', each)),
    ]


def _literal(value: bool | float | str) -> str:
    """Return a value as the ROS command line wants it."""
    if isinstance(value, bool):
        return str(value).lower()
    return f"'{value}'" if isinstance(value, str) else repr(value)
