# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A time-out around a driver that may hang."""

from __future__ import annotations

from collections.abc import Callable
from queue import Empty, SimpleQueue
from typing import Any, TypeVar

from .. import threads
from ..physics import Drive
from ..physics.potential import Array
from .driver import Driver
from .errors import DriverError

T = TypeVar('T')

PATIENCE = 10.0
"""Seconds after which a call to a driver times out."""


class Watched(Driver):
    """Runs a driver in a thread of its own, which is abandoned if it hangs."""

    def __init__(
        self, name: str, make: Callable[[], Driver], seconds: float, patience: float = PATIENCE
    ) -> None:
        """Open a driver.

        Args:
            name: Its name in messages.
            make: Opens and returns the driver.
            seconds: Seconds per time unit of the element.
            patience: Time-out of a call, in seconds.

        Raises:
            DriverError: It hangs, or as `make` raises.
        """
        self._name, self._seconds, self._patience = name, seconds, patience
        self._work: SimpleQueue[Callable[[], Any] | None] = SimpleQueue()
        self._done: SimpleQueue[tuple[Any, BaseException | None]] = SimpleQueue()
        self._hangs = self._closed = False
        threads.Thread(target=self._run, name='mlmem-driver', daemon=True).start()
        try:
            self.driver = self._asked('opening', make)
        except BaseException:
            self._work.put(None)
            raise
        self.dt, self.nodes, self.lag = self.driver.dt, self.driver.nodes, self.driver.lag
        self.own_clock = self.driver.own_clock

    @property
    def V_N(self) -> float:  # type: ignore[override]
        """The driver's last set-point."""
        return self.driver.V_N

    @property
    def interrupted(self) -> bool:  # type: ignore[override]
        """Whether the driver was interrupted."""
        return self.driver.interrupted

    def advance(
        self, V_N: Array, drive: Drive | None = None, shake: Array | None = None, looks: int = 1
    ) -> Array:
        """Return the samples of the driver; raises `DriverError` if it takes too long."""
        playing = len(V_N) / len(self.nodes) * self.dt * self._seconds
        return self._asked(
            'playing', lambda: self.driver.advance(V_N, drive, shake, looks), playing
        )

    def end(self, site: int) -> float:
        """Return the displacement of an end."""
        return self.driver.end(site)

    def force(self) -> float | None:
        """Return the force, if it is measured."""
        return self.driver.force()

    def health(self) -> dict[str, float | str]:
        """Return the driver's values for diagnostics."""
        return self.driver.health()

    def close(self) -> None:
        """Close the driver, unless it hangs."""
        if not (self._closed or self._hangs):
            self._closed = True
            self._asked('closing', self.driver.close)
            self._work.put(None)

    def _asked(self, what: str, work: Callable[[], T], more: float = 0.0) -> T:
        if self._hangs:
            raise DriverError(f'the driver {self._name} hangs')
        self._work.put(work)
        try:
            value, error = self._done.get(timeout=self._patience + more)
        except Empty:
            self._hangs = True
            raise DriverError(
                f'the driver {self._name} hangs: {what} takes longer than {self._patience:g} s'
            ) from None
        if error is not None:
            raise error
        result: T = value
        return result

    def _run(self) -> None:
        while (work := self._work.get()) is not None:
            try:
                self._done.put((work(), None))
            except BaseException as error:
                self._done.put((None, error))
