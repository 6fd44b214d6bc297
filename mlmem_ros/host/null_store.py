# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An element without a state file: nothing of it survives a restart."""

from __future__ import annotations

from concurrent.futures import Future

from .. import threads
from ..device import Driver, Loop, MemoryElement, Settings, new_element
from ..device.mailbox import Asked
from ..physics import Design
from .worker import Worker


class NullStore:
    """Stands for a `Store` where `state.path` is empty."""

    path = None

    def __init__(self, worker: Worker) -> None:
        """Share the worker of older stores, which may still write."""
        self._worker = worker

    def new_element(self, design: Design, settings: Settings, driver: Driver) -> MemoryElement:
        """Return a device; see `Store.new_element`."""
        return new_element(design, settings, driver=driver)

    def restore(self, element: MemoryElement) -> None:
        """Leave a new device as it is."""

    def keep(self, element: MemoryElement) -> Future[None]:
        """Return that nothing is left to save."""
        saved: Future[None] = threads.Future()
        saved.set_result(None)
        return saved

    def settle(self, request: Asked, element: MemoryElement) -> None:
        """Answer a request whose procedure has ended."""
        assert request.outcome is not None
        request.settle(request.outcome)

    def on_timer(self, loop: Loop | None) -> None:
        """Answer overdue requests; call it once a second."""
        self._worker.on_timer()

    def settled(self) -> bool:
        """Wait, but not for long, until older states are saved; return whether they are."""
        return self._worker.wait()

    close = settled
