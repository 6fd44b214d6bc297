# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A memory node that runs for a test, wherever it does."""

from __future__ import annotations

from abc import ABC, abstractmethod
from contextlib import ExitStack
from functools import cached_property
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from typing_extensions import Self

    from ..ros.client import MemoryClient


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
        """A client of it, made when it is first asked for."""
        from ..ros.client.standalone import standalone

        return self.ends.enter_context(standalone(self.element))

    @abstractmethod
    def step(self, ticks: int) -> int:
        """Run ticks while time is held; return the ticks it has made in its life.

        Raises:
            RequestRefused: Its time is not held, or it has failed.
        """

    @property
    @abstractmethod
    def output(self) -> str:
        """All that it has logged."""

    @property
    @abstractmethod
    def running(self) -> bool:
        """Whether it has not ended yet."""

    @abstractmethod
    def terminate(self) -> None:
        """Ask it to end, if it still runs, as SIGTERM does."""

    @abstractmethod
    def exit_status(self, within: float = 20.0) -> int:
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
