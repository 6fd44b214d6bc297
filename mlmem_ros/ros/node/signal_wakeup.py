# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Signals end an executor's wait, so that nobody has to poll for them ten times a second."""

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

    Python runs a handler in the main thread, once it returns from the middleware's wait, which
    signals do not interrupt. But the interpreter writes a byte when the signal comes, and our
    thread that waits for it wakes the executor.

    Args:
        executor: The one that the main thread spins; it must outlive the context.
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
