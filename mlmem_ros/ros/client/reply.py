# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The future answer to a request, which can be awaited, in rclpy and asyncio, or waited for."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Awaitable, Callable, Generator
from concurrent.futures import Future, InvalidStateError
from concurrent.futures import TimeoutError as NotYet
from contextlib import suppress
from typing import Any, TypeVar

from rclpy.executors import Executor
from rclpy.node import Node
from rclpy.task import Future as RclpyFuture
from rclpy.timer import Timer

from ..middleware import DESTROYED_ERRORS

T = TypeVar('T')

CLIENT_THREAD_NAME = 'mlmem-client'
"""Name of the threads that take answers."""


class Reply(Future[T]):
    """The future answer to a request, which is sent when the reply is created.

    In a coroutine, such as an `async def` callback or one of asyncio, await it::

        async def on_button(self, _):
            content = await self.memory.write(5)

    The executor runs other callbacks meanwhile, except those of the same callback group:
    `MemoryClient.group` is one for callbacks that await. Anywhere else, wait for it::

        content = client.write(5).wait()

    or attach `add_done_callback`. Either way the result is the answer, or a `RequestError` is
    raised. It is a `concurrent.futures.Future`, so `concurrent.futures.wait` takes several.
    """

    def __init__(self, node: Node) -> None:
        """Make the reply to a request of a robot's node."""
        super().__init__()
        self._node = node

    def wait(self) -> T:
        """Block this thread until the answer comes, and return it.

        A thread of the client's own takes the answer. So this works whether or not anybody spins
        the node, even in a callback.

        Raises:
            RequestError: There is no answer, or it reports an error.
            RuntimeError: This is the client's own thread, in which callbacks run of `standalone`,
                and of replies if the node has no executor.
        """
        if threading.current_thread().name == CLIENT_THREAD_NAME and not self.done():
            raise RuntimeError('this thread takes the answers: await the reply, or wait elsewhere')
        while not self.done():
            with suppress(NotYet):
                self.exception(0.1)  # then look for signals, which another thread may have got
        return self.result()

    def __await__(self) -> Generator[Any, None, T]:
        """Suspend the coroutine, of rclpy or asyncio, until the answer comes."""
        return self._await_answer().__await__()

    async def _await_answer(self) -> T:
        if not self.done():
            waiting, resume = create_suspension(self._node)
            super().add_done_callback(resume)
            try:
                await waiting
            except asyncio.CancelledError:  # as of `asyncio.wrap_future`
                self.cancel()
                raise
        return self.result()

    def cancel(self) -> bool:
        """Give up the answer, as other futures do.

        The node cancels a procedure that was requested by an action; others go on until
        `MemoryClient.abort` stops them.
        """
        if not self.cancelled() and super().cancel():
            self.set_running_or_notify_cancel()  # whoever waits for several replies
        return self.cancelled()

    def add_done_callback(self, fn: Callable[[Future[T]], object]) -> None:
        """Have a function called with the reply: by the executor of the robot's node, if it has
        one, or else in the thread that takes the answer.
        """
        executor = self._node.executor
        if executor is None:
            super().add_done_callback(fn)
        else:
            super().add_done_callback(lambda _: executor.create_task(fn, self))

    def settle(self, outcome: T | Exception) -> None:
        """End with a result or an error, unless it has ended or was given up."""
        with suppress(InvalidStateError):
            if isinstance(outcome, Exception):
                self.set_exception(outcome)
            else:
                self.set_result(outcome)


def create_suspension(node: Node) -> tuple[Awaitable[object], Callable[[object], None]]:
    """Return what a coroutine, of asyncio or else of an executor, awaits, and the function by
    which another thread resumes it.

    A task of rclpy 7.1.9 and later refuses a future of another executor than its own; one without
    an executor it takes over. Before, a task is resumed when its executor wakes next, so the node
    of the client should be in the same one.
    """
    executor = node.executor
    try:
        loop = asyncio.get_running_loop()
    except RuntimeError:  # an executor runs the coroutine
        task_future = RclpyFuture()

        def resume_task(_: object) -> None:
            task_future.set_result(None)
            if isinstance(executor, Executor):
                executor.wake()
            elif executor is not None:  # one of events resumes only after a callback of the node
                with suppress(*DESTROYED_ERRORS):
                    timer: Timer = node.create_timer(
                        0.0, lambda: node.destroy_timer(timer), autostart=False
                    )
                    timer.reset()

        return task_future, resume_task
    future = loop.create_future()

    def end_waiting() -> None:
        if not future.done():
            future.set_result(None)

    def resume_in_loop(_: object) -> None:
        with suppress(RuntimeError):  # the loop is closed
            loop.call_soon_threadsafe(end_waiting)

    return future, resume_in_loop
