# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A memory node that runs, for instance in a process of its own, and its faults."""

from __future__ import annotations

import subprocess
import tempfile
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from ..ros.node_process import node_process

if TYPE_CHECKING:
    from typing_extensions import Self

    from ..ros.client import MemoryClient

START = 60.0
"""Seconds that a node may take to start on a busy machine."""


class RunningNode(ABC):
    """A memory node that runs, until the end of its context.

    Attributes:
        element: Its full name.
    """

    def __init__(self, element: str) -> None:
        self.element = element
        self.ends = ExitStack()

    @cached_property
    def memory(self) -> MemoryClient:
        """A client of it, created on first use."""
        from ..ros.client.standalone import standalone

        return self.ends.enter_context(standalone(self.element, START))

    @abstractmethod
    def step(self, ticks: int) -> int:
        """Run ticks while time is paused; return the ticks since its start.

        Raises:
            RequestRefused: Its time is not paused, or it has failed.
        """

    @property
    @abstractmethod
    def output(self) -> str:
        """All that it has logged."""

    @property
    @abstractmethod
    def running(self) -> bool:
        """Whether it is still running."""

    @abstractmethod
    def terminate(self) -> None:
        """Ask it to end, like SIGTERM, if it is still running."""

    @abstractmethod
    def exit_status(self, within: float = 60.0) -> int:
        """Wait for its end; return the exit status of `memory_node`.

        Raises:
            TimeoutError: It does not end in time.
        """

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.terminate()
        self.exit_status()
        self.ends.close()


class NodeApart(RunningNode):
    """A running process of `memory_node`."""

    def __init__(self, element: str, arguments: Sequence[str]) -> None:
        super().__init__(element)
        folder = self.ends.enter_context(tempfile.TemporaryDirectory(prefix='memory-node-'))
        self._output = Path(folder, 'output.txt')
        with self._output.open('wb') as output:
            self._process = self.ends.enter_context(
                node_process(arguments, stdout=output, stderr=subprocess.STDOUT)
            )

    def step(self, ticks: int) -> int:
        """Run ticks while time is paused; return the ticks since its start."""
        return [self.memory.step().wait().tick for _ in range(ticks)][-1]

    @property
    def output(self) -> str:
        """Its output, on both streams."""
        return self._output.read_text(encoding='utf-8')

    @property
    def running(self) -> bool:
        """Whether it is still running."""
        return self._process.poll() is None

    @property
    def pid(self) -> int:
        """Process id."""
        return self._process.pid

    def signal(self, number: int) -> None:
        """Send it a signal."""
        self._process.send_signal(number)

    def terminate(self) -> None:
        """Ask it to end, if it is still running."""
        self._process.terminate()

    def exit_status(self, within: float = 60.0) -> int:
        """Wait for its end; negative: the signal that killed it."""
        try:
            return self._process.wait(within)
        except subprocess.TimeoutExpired:
            raise TimeoutError(f'{self.element} did not end within {within:g} s') from None

    def __exit__(self, *_: object) -> None:
        self.ends.close()


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
