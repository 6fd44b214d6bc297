# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A memory node in the test's process, with an executor in its own thread."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from typing import Any

from rclpy.context import Context
from rclpy.utilities import try_shutdown

from ..contract.calls import RequestRefused
from ..device.mailbox import Steps
from ..host import REFUSALS
from ..ros.node.command_line import ros_arguments
from ..ros.node.node import MemoryNode
from ..ros.node.run import ONE, Element, begin, end, turn
from .node import RunningNode

STEPPED = 60.0
"""Seconds that a machine may take to run the ticks requested at a time."""


class NodeHere(RunningNode):
    """A node, or several, their executor and its thread.

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
