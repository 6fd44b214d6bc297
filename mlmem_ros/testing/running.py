# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A memory node that runs for a test, in this process or another."""

from __future__ import annotations

from abc import ABC, abstractmethod
from contextlib import ExitStack
from functools import cached_property
from typing import TYPE_CHECKING

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
        from ..ros.client.client import standalone

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
