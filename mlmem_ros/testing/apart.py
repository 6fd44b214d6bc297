# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A memory node as a process of its own."""

from __future__ import annotations

import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path

from ..ros.node_process import node_process
from .running import RunningNode


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
