# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A memory node that runs for a test, in its process or in one of its own."""

from __future__ import annotations

import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from os import PathLike
from typing import Any

from rclpy.context import Context
from rclpy.utilities import try_shutdown

from ..contract.calls import RequestRefused
from ..device.mailbox import Steps
from ..host import REFUSALS
from ..ros.node.command_line import ros_arguments
from ..ros.node.node import MemoryNode
from ..ros.node.run import ONE, Element, begin, end, turn
from ..ros.node_process import Parameters, node_arguments
from .running import NodeApart, RunningNode

STEPPED = 60.0
"""Seconds that a machine may take to run the ticks requested at a time."""


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
        with NodeApart(element, [*options, *command]) as node:
            yield node
    else:
        with NodeHere(element, ['memory_node', *options, *command]) as node:
            yield node


class NodeHere(RunningNode):
    """A node in this process, or several, their executor and its thread.

    Attributes:
        nodes: All of them.
    """

    def __init__(
        self, element: str, arguments: Sequence[str], elements: Sequence[Element] = ONE
    ) -> None:
        """Start the nodes, the first named `element`; raises what keeps them from starting."""
        super().__init__(element)
        self._said: list[str] = []
        self._stop: list[None] = []
        self._status: int | None = None
        said = self._said

        class Overheard(MemoryNode):
            """A node that keeps its log."""

            def get_logger(self) -> Any:
                made: Any = super().get_logger()
                return made if isinstance(made, Kept) else Kept(made, said)  # in Kilted it is

        context = Context()
        try:
            self.nodes, self._executor = begin(
                ros_arguments(arguments), context, Overheard, elements
            )
        except BaseException:
            try_shutdown(context=context)
            raise
        self._thread = threading.Thread(target=self._run, name='mlmem-node', daemon=True)
        self._thread.start()

    def _run(self) -> None:
        turn(self._executor, self._stop)
        self._status = end(self.nodes, self._executor)

    @property
    def node(self) -> MemoryNode:
        """The first node."""
        return self.nodes[0]

    def step(self, ticks: int) -> int:
        """Run ticks while time is paused; return the ticks since its start."""
        try:
            return self.node.host.step(Steps(ticks)).answer.result(STEPPED)
        except REFUSALS as refusal:
            raise RequestRefused({'error': str(refusal)}) from refusal

    @property
    def output(self) -> str:
        """Its log, in console format."""
        return ''.join(self._said)

    @property
    def running(self) -> bool:
        """Whether it is still running."""
        return self._thread.is_alive()

    def terminate(self) -> None:
        """Ask it to end, if it is still running."""
        if not self._stop:
            self._stop.append(None)
            self._executor.interrupt()

    def exit_status(self, within: float = 60.0) -> int:
        """Wait for its end.

        Raises:
            TimeoutError: It does not end in time.
        """
        self._thread.join(within)
        if self._status is None:
            raise TimeoutError(f'{self.element} did not end within {within:g} s')
        return self._status


class Kept:
    """A logger that keeps what it logs.

    Each severity has its own source line, since rclpy allows only one severity a line.
    """

    def __init__(self, logger: Any, said: list[str]) -> None:
        self._logger = logger
        self._said = said

    def info(self, text: str) -> None:
        """Keep it, and log it."""
        self._keep('INFO', text)
        self._logger.info(text)

    def warning(self, text: str) -> None:
        """Keep it, and log it."""
        self._keep('WARN', text)
        self._logger.warning(text)

    def error(self, text: str) -> None:
        """Keep it, and log it."""
        self._keep('ERROR', text)
        self._logger.error(text)

    def _keep(self, severity: str, text: str) -> None:
        self._said.append(f'[{severity}] [{self._logger.name}]: {text}\n')

    def __getattr__(self, name: str) -> Any:
        return getattr(self._logger, name)
