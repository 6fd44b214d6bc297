# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A pending request: a future that can be awaited, in rclpy and asyncio, or waited for."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Generator
from concurrent.futures import Future
from concurrent.futures import TimeoutError as NotYet
from contextlib import suppress
from numbers import Real
from typing import Any, TypeVar

from rclpy.executors import Executor
from rclpy.node import Node
from rclpy.task import Future as RclpyFuture
from rclpy.timer import Timer

from mlmem.schema import short_repr

from ..middleware import DESTROYED_ERRORS
from .node_connection import NodeConnection
from .request import Request, Steps

T = TypeVar('T')

SIGNAL_PERIOD_S = 0.1
"""Seconds after which a waiting thread looks for signals, which another thread may have got."""


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

    Attributes:
        freed: Done when the node has nothing more to do with it, as far as is known: later, if
            the answer to a procedure was given up.
    """

    def __init__(
        self,
        connection: NodeConnection,
        what: str,
        steps: Callable[[Request], Steps[T]],
        timeout: float,
        patience: float | None = None,
    ) -> None:
        """Begin to ask for `what`, with a time-out in seconds for all of it, and with another
        patience than the connection's if given.
        """
        super().__init__()
        self._connection, self._what = connection, what
        patience = connection.patience if patience is None else patience
        timeout = check_seconds('timeout', timeout)
        self._request = Request(connection, what, steps, timeout, patience, self)
        self.freed = self._request.freed
        self._awaiting: set[object] = set()  # coroutines and threads
        connection.thread.post(self._request.start)

    def wait(self) -> T:
        """Block this thread until the answer comes, and return it.

        A thread of the client's own takes the answer. So this works whether or not anybody spins
        the node, even in a callback.

        Raises:
            RequestError: There is no answer, or it reports an error.
            RuntimeError: This is the client's own thread, in which callbacks of the reply run if
                the node has no executor.
        """
        if self._connection.thread.is_current_thread and not self.done():
            raise RuntimeError('this thread takes the answers: await the reply, or wait elsewhere')
        waiter = object()
        self._awaiting.add(waiter)
        try:
            while not self.done():
                with suppress(NotYet):
                    self.exception(SIGNAL_PERIOD_S)
        finally:
            self._awaiting.discard(waiter)
        return self.result()

    def __await__(self) -> Generator[Any, None, T]:
        """Suspend the coroutine, of rclpy or asyncio, until the answer comes."""
        if not self.done():
            suspension = Suspension(self._connection.node)
            super().add_done_callback(suspension.resume)
            self._awaiting.add(suspension)
            try:
                yield from suspension.__await__()
            except asyncio.CancelledError:  # asyncio's time-outs end what they wait for
                if self._awaiting == {suspension}:  # another task may wait for the same
                    self.cancel()
                raise
            finally:
                self._awaiting.discard(suspension)
        return self.result()

    def cancel(self) -> bool:
        """Give up the answer, as other futures do. The node cancels a procedure that was requested
        by an action; others go on until `MemoryClient.abort` stops them.
        """
        cancelled = super().cancel() and not self.set_running_or_notify_cancel()
        self._connection.thread.post(self._request.give_up)
        return cancelled

    def add_done_callback(self, fn: Callable[[Future[T]], object]) -> None:
        """Have a function called with the reply: by the executor of the robot's node, if it has
        one, or else in the thread that takes the answer.
        """
        executor = self._connection.node.executor
        if executor is None:
            super().add_done_callback(fn)
        else:
            super().add_done_callback(lambda _: executor.create_task(fn, self))


class Suspension:
    """Suspends a coroutine, of rclpy or asyncio, until another thread resumes it."""

    def __init__(self, node: Node) -> None:
        """Suspend one that runs in asyncio's loop, or else in the executor of a node."""
        self._node = node
        self._future: Any
        try:
            self._loop = asyncio.get_running_loop()
            self._future = self._loop.create_future()
        except RuntimeError:  # an executor runs the coroutine
            self._future = RclpyFuture(executor=node.executor)

    def resume(self, _: Any = None) -> None:
        """Have it go on; from any thread."""
        if isinstance(self._future, RclpyFuture):
            self._future.set_result(None)
        else:
            with suppress(RuntimeError):  # the loop is closed
                self._loop.call_soon_threadsafe(self._resume_future)
        wake_executor(self._node)

    def _resume_future(self) -> None:
        if not self._future.done():  # or cancelled with its task
            self._future.set_result(None)

    def __await__(self) -> Generator[Any, None, None]:
        while not self._future.done():  # an executor that asyncio spins resumes it earlier
            self._future._asyncio_future_blocking = True
            yield self._future


def wake_executor(node: Node) -> None:
    """Have the executor of a node, if there is one, resume its coroutines.

    The executor of events does so only after a callback of the node, and takes no guard condition.
    """
    executor = node.executor
    if isinstance(executor, Executor):
        executor.wake()
    elif executor is not None:
        with suppress(*DESTROYED_ERRORS):
            timers: list[Timer] = []  # it may fire before it is in here, and then fires again

            def destroy_timers() -> None:
                while timers:
                    node.destroy_timer(timers.pop())

            timers.append(node.create_timer(0.0, destroy_timers))


def check_seconds(name: str, value: Any) -> float:
    """Return a time above 0.

    Raises:
        ValueError: It is none.
    """
    if isinstance(value, bool) or not isinstance(value, Real) or not float(value) > 0.0:
        raise ValueError(f'{name} must be above 0 s; got {short_repr(value)}')
    return float(value)
