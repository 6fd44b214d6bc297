# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Waiting for a real element that is off at the start, or lost: it is taken back."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Protocol

from ...device import DriverError, DriverHangs
from ...host import REFUSALS, Host


class Node(Protocol):
    """What is needed of the node."""

    @property
    def unconfigured(self) -> bool:
        """Whether it is in that state."""

    def start(self) -> None:
        """Configure and activate; raises one of `REFUSALS`."""


class Retries:
    """Tries again at intervals, until the element is back or somebody else configures the node.

    Attributes:
        waiting: Whether it waits for an element.
    """

    def __init__(self, node: Node, host: Host, interval: Callable[[], float]) -> None:
        """Wait for nothing yet; the interval between two attempts is in seconds, 0 to give up."""
        self._node, self._host, self._interval = node, host, interval
        self.waiting = False
        self._attempts = 0
        self._since = self._next = -math.inf

    def begin(self, why: BaseException | None) -> bool:
        """Wait for the element after an error, if that may help; return whether it will."""
        interval = self._interval()
        if not _lost(why) or not interval:
            return False
        self.waiting, self._attempts, self._since = True, 0, time.monotonic()
        self._host.log.warning(f'waiting for the element, every {interval:g} s: {why}')
        self._tell(why, interval)
        return True

    def on_timer(self) -> None:
        """Try again if it is time; call it often while the node may change its state."""
        if not self.waiting:
            return
        interval = self._interval()
        if not (interval and self._node.unconfigured):
            self.waiting = False
            return
        if time.monotonic() < self._next:
            return
        self._attempts += 1
        try:
            self._node.start()
        except REFUSALS as error:
            if _lost(error):
                self._tell(error, interval)
                return
            self.waiting = False
            self._host.log.error(f'the element is back, but cannot be started: {error}')
        else:
            self.waiting = False
            self._host.log.warning(f'the element is back after {self._waited:.3g} s')

    @property
    def _waited(self) -> float:
        return time.monotonic() - self._since

    def _tell(self, why: object, interval: float) -> None:
        self._next = time.monotonic() + interval
        waited = f'{self._waited:.0f} s ({self._attempts} attempts)'
        self._host.stopped = f'waiting for the element since {waited}: {why}'


def _lost(why: BaseException | None) -> bool:
    """Whether the element is away and may come back; a driver that hangs never does."""
    return isinstance(why, DriverError) and not isinstance(why, DriverHangs)
