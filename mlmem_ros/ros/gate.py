# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The one way in for commands: to the loop while the node is active, refused otherwise."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from typing import Any, TypeVar

from ..device import Command, Loop, Outcome, Refused
from ..device.settings import ScaleSettings

T = TypeVar('T')


class Gate:
    """Hands commands to the running loop.

    Attributes:
        loop: The loop while the node is active, else None.
        refused: Commands refused since the node was made.
    """

    def __init__(self) -> None:
        self.loop: Loop | None = None
        self.refused = 0

    def open_loop(self) -> Loop:
        """Return the running loop.

        Raises:
            Refused: The node is not active.
        """
        if self.loop is None:
            raise Refused('inactive: configure and activate the node first')
        return self.loop

    def submit(self, command: Command) -> Future[Outcome | None]:
        """Hand in a command for the next tick; see `Loop.submit`."""
        return self._counted(lambda: self.open_loop().submit(command))

    def submit_scaled(self, make: Callable[[ScaleSettings], Command]) -> Future[Outcome | None]:
        """Hand in a command made of SI values, which the device's scale turns into its own."""

        def ask() -> Future[Outcome | None]:
            loop = self.open_loop()
            return loop.submit(make(loop.element.settings.scale))

        return self._counted(ask)

    def step(self) -> Future[int]:
        """Run one tick while paused; see `Loop.single_tick`."""
        return self._counted(lambda: self.open_loop().single_tick())

    def pause(self, paused: bool) -> Future[int]:
        """Hold time or let it run on; see `Loop.pause`."""
        return self._counted(lambda: self.open_loop().pause(paused))

    def _counted(self, ask: Callable[[], Future[T]]) -> Future[T]:
        try:
            answer = ask()
        except Refused as refusal:
            answer = Future()
            answer.set_exception(refusal)
        answer.add_done_callback(self._count)
        return answer

    def _count(self, answer: Future[Any]) -> None:
        if isinstance(answer.exception(), Refused):
            self.refused += 1
