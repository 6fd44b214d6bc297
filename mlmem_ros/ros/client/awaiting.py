# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Waiting for rclpy's futures in coroutines: in those of an executor, and in asyncio's."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Generator
from types import coroutine
from typing import Any

from rclpy.task import Future

TAKE = 0.002
"""Seconds between two checks for an answer, where no executor need deliver it."""


@coroutine
def suspended(future: Future, meanwhile: Callable[[], object]) -> Generator[Any, None, None]:
    """Suspend a coroutine until a future of rclpy is done or cancelled; a loop of asyncio calls
    `meanwhile`, whether or not anybody spins the node.
    """
    try:
        loop = asyncio.get_running_loop()
    except RuntimeError:  # an executor runs the coroutine
        yield from Future.__await__(future)
        return
    while not (future.done() or future.cancelled()):
        meanwhile()
        yield from _turn(loop)


def _turn(loop: asyncio.AbstractEventLoop) -> Generator[Any, None, None]:
    """Let others run for `TAKE` seconds.

    The future of asyncio is yielded as its own `__await__` would do it. But that raises an error
    if an executor, spun by a coroutine of asyncio, resumes its coroutine earlier.
    """
    turn = loop.create_future()
    timer = loop.call_later(TAKE, turn.set_result, None)
    turn._asyncio_future_blocking = True
    try:
        yield turn
    finally:
        timer.cancel()
