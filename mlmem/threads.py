# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Threads and all that they wait on, so that a test can substitute a scheduler and a clock.

Write `threads.Condition()`, with the module's name, so that substitutes take effect.
"""

from collections.abc import Callable
from concurrent.futures import Future
from threading import Condition, Lock, Thread
from time import monotonic, time
from typing import TypeVar

__all__ = ['Condition', 'Future', 'Lock', 'Thread', 'monotonic', 'run_in_thread', 'time']

Answer = TypeVar('Answer')


def run_in_thread(function: Callable[[], Answer]) -> Future[Answer]:
    """Call a function in a thread of its own; return what will hold its result or exception."""
    future: Future[Answer] = Future()

    def call_function() -> None:
        try:
            future.set_result(function())
        except BaseException as failure:
            future.set_exception(failure)

    Thread(target=call_function, name='mlmem-background', daemon=True).start()
    return future
