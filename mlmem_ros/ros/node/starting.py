# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What may hold up a start: kernels to compile, an element that is off."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from mlmem import DriverError, DriverHangs
from mlmem.physics import INTEGRATORS, Design, is_kernel_cached

from ...host import REFUSALS, Host

if TYPE_CHECKING:
    from .node import MemoryNode


class Retries:
    """Tries again at intervals, until the element is back or somebody else configures the node."""

    def __init__(self, node: MemoryNode) -> None:
        """Wait for nothing yet."""
        self._node, self._host = node, node.host
        self.waiting = False
        self._attempts = 0
        self._since = self._next = -math.inf

    def begin(self, why: BaseException | None) -> bool:
        """Wait for the element after an error, if that may help; return whether it will."""
        interval = self._node.get_parameter('device.retry').value  # 0: give up
        if not _is_element_lost(why) or not interval:
            return False
        self.waiting, self._attempts, self._since = True, 0, time.monotonic()
        self._host.log.warning(f'waiting for the element, every {interval:g} s: {why}')
        self._report_wait(why, interval)
        return True

    def on_timer(self) -> None:
        """Try again if it is time; call it often while the node may change its state."""
        if not self.waiting or time.monotonic() < self._next:
            return
        interval = self._node.get_parameter('device.retry').value  # 0: give up
        if not (interval and self._node.unconfigured):
            self.waiting = False
            return
        self._attempts, self._next = self._attempts + 1, math.inf
        try:
            prepared = self._node.prepare()
        except REFUSALS as error:
            self._stop_retrying(error)
        else:
            prepared.add_done_callback(lambda _: self._start_node(interval))

    def _start_node(self, interval: float) -> None:
        """Start with the device that has been built, in the executor's thread."""
        if not (self.waiting and self._node.unconfigured):  # closed, or configured by others
            self.waiting = False
            return
        try:
            self._node.start()
        except REFUSALS as error:
            if _is_element_lost(error):
                self._report_wait(error, interval)
            else:
                self._stop_retrying(error)
        else:
            self.waiting = False
            self._host.log.warning(f'the element is back after {self._waited_seconds:.3g} s')

    def _stop_retrying(self, why: Exception) -> None:
        self.waiting = False
        self._host.log.error(f'the element is back, but cannot be started: {why}')

    @property
    def _waited_seconds(self) -> float:
        return time.monotonic() - self._since

    def _report_wait(self, why: object, interval: float) -> None:
        self._next = time.monotonic() + interval
        waited = f'{self._waited_seconds:.0f} s ({self._attempts} attempts)'
        self._host.stopped = f'waiting for the element since {waited}: {why}'


def _is_element_lost(why: BaseException | None) -> bool:
    """Whether the element is away and may come back; a driver that hangs never does."""
    return isinstance(why, DriverError) and not isinstance(why, DriverHangs)


@contextmanager
def report_preparation(host: Host, design: Design, integrator: str) -> Iterator[None]:
    """Say in `host.preparing` what the body does, and log it if it must compile kernels first."""
    host.preparing, begun = 'preparing the device', time.monotonic()
    try:
        if not (cached := is_kernel_cached(design, INTEGRATORS[integrator])):
            kernels = f'the kernels of the {design.substrate} substrate ({integrator})'
            host.preparing = f'compiling {kernels}'
            host.log.info(f'{host.preparing} (once; it takes some seconds)')
        yield
    finally:
        host.preparing = ''
    if not cached:
        host.log.info(f'compiled in {time.monotonic() - begun:.1f} s, and cached')
