# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Signals end an executor's wait, so that nobody has to look for them ten times a second."""

from __future__ import annotations

import signal
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager

from .executor import GuardedExecutor


@contextmanager
def woken_by_signals(executor: GuardedExecutor) -> Iterator[None]:
    """Let every signal that Python handles wake an executor.

    Python runs a handler in the main thread, once that is out of the middleware's wait: which no
    signal interrupts. But the interpreter writes a byte as the signal comes, and a thread of ours
    that waits for it wakes the executor.

    Args:
        executor: The one the main thread spins; must live until the end of the context.
    """
    ours, interpreters = socket.socketpair()
    interpreters.setblocking(False)
    before = signal.set_wakeup_fd(interpreters.fileno(), warn_on_full_buffer=False)

    def wake() -> None:
        while ours.recv(1):
            executor.interrupt()

    thread = threading.Thread(target=wake, name='mlmem-signals', daemon=True)
    thread.start()
    try:
        yield
    finally:
        signal.set_wakeup_fd(before)
        interpreters.close()  # which the thread reads as the end
        thread.join()
        ours.close()
