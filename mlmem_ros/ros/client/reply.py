# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A pending request: a future that can be awaited, in rclpy and asyncio, or waited for.

What leads to an answer is a generator: it yields a call and is sent the response, or it yields
futures and goes on when all are done. It runs in whatever thread delivers what it waits for.
"""

from __future__ import annotations

import asyncio
import math
import threading
import time
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import Future, InvalidStateError
from concurrent.futures import TimeoutError as NotYet
from contextlib import contextmanager, suppress
from numbers import Real
from typing import Any, TypeVar

from rclpy.exceptions import InvalidHandle
from rclpy.task import Future as RclpyFuture

from mlmem.schema import short_repr

from ...contract.calls import NoAnswer
from .node_connection import Call, NodeConnection, NodeEndpoints

T = TypeVar('T')

SIGNAL_PERIOD_S = 0.1
"""Seconds after which a waiting thread looks for signals, which another thread may have got."""

ReplySteps = Generator[Call | Sequence[Future[Any]], Any, T]


class _GivenUp(NoAnswer):
    """The answer was given up by `Reply.cancel`."""


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

    _lasting = False
    """Whether the node is listened to even if the answer is given up."""

    def __init__(
        self,
        connection: NodeConnection,
        what: str,
        steps: ReplySteps[T],
        timeout: float,
        patience: float | None = None,
    ) -> None:
        """Begin to ask for `what`, with a time-out in seconds for all of it, and with another
        patience than the connection's if given.
        """
        super().__init__()
        self._connection, self._what, self._steps = connection, what, steps
        self._timeout = check_seconds('timeout', timeout)
        self._patience = min(connection.patience if patience is None else patience, timeout)
        self._begun = self._looked = time.monotonic()
        self._until = self._begun + self._timeout  # later, if the node prepares meanwhile
        self.freed: Future[None] = Future()
        self._step: Call | Sequence[Future[Any]] = ()
        self._asked = self._seen = 0.0  # since when the step is due; when its service was there
        self._sent: Any = None  # rclpy's future of the step's response
        self._endpoints: NodeEndpoints | None = None  # through which it was sent
        self._waiting = 0  # coroutines and threads
        self._over = False  # nothing more is sent
        self._lock = threading.Lock()
        self._resume_steps()
        if not self.freed.done():
            connection.line.watch(self)

    def wait(self) -> T:
        """Block this thread until the answer comes, and return it.

        A thread of the client's own takes the answer. So this works whether or not anybody spins
        the node, even in a callback.

        Raises:
            RequestError: There is no answer, or it reports an error.
            RuntimeError: This is the client's own thread, in which callbacks of the reply run if
                the node has no executor.
        """
        if self._connection.line.is_current_thread and not self.done():
            raise RuntimeError('this thread takes the answers: await the reply, or wait elsewhere')
        with self._count_waiter():
            while not self.done():
                with suppress(NotYet):
                    self.exception(SIGNAL_PERIOD_S)
        return self.result()

    def __await__(self) -> Generator[Any, None, T]:
        """Suspend the coroutine, of rclpy or asyncio, until the answer comes."""
        if not self.done():
            turn = Turn(self._connection)
            super().add_done_callback(turn.tell)
            try:
                with self._count_waiter():
                    yield from turn.__await__()
            except asyncio.CancelledError:  # asyncio's time-outs end what they wait for
                if not self._waiting:  # another task may wait for the same
                    self.cancel()
                raise
        return self.result()

    @contextmanager
    def _count_waiter(self) -> Iterator[None]:
        """Count one who waits for the answer."""
        with self._lock:
            self._waiting += 1
        try:
            yield
        finally:
            with self._lock:
                self._waiting -= 1

    def cancel(self) -> bool:
        """Give up the answer: then it is a `NoAnswer`. This does not stop the element, as
        `MemoryClient.abort` does.
        """
        on = (
            ', and the element goes on with it'
            if self._has_reached_node()
            else ' before it was sent'
        )
        why = f'the answer to {self._what} was given up{on}'
        self._set_error(_GivenUp(f'{self._connection.peer}: {why}'))
        with self._lock:  # the client's thread may send it meanwhile
            self._over = over = not (self._lasting and self._has_reached_node())
        if over:
            self._end_request()
        return self.cancelled()

    def _has_reached_node(self) -> bool:
        """Return whether the node may have something to do with it."""
        return self._sent is not None

    def cancelled(self) -> bool:
        """Return whether the answer was given up."""
        return self.done() and isinstance(self.exception(), _GivenUp)

    def add_done_callback(self, fn: Callable[[Future[T]], object]) -> None:
        """Have a function called with the reply: by the executor of the robot's node, if it has
        one, or else in the thread that takes the answer.
        """
        executor = self._connection.node.executor
        if executor is None:
            super().add_done_callback(fn)
        else:
            super().add_done_callback(lambda _: executor.create_task(fn, self))

    # --- going on ---------------------------------------------------------------------------

    def _resume_steps(self, heard: Any = None) -> None:
        """Go on with what the generator has waited for."""
        if self.freed.done():
            return
        try:
            step, now = self._steps.send(heard), time.monotonic()
            with self._lock:  # the client's thread may look meanwhile
                self._step, self._sent, self._asked = step, None, now
            if isinstance(step, Call):
                self._send()
            else:
                self._await_futures(step)
        except StopIteration as end:
            with suppress(InvalidStateError):
                self.set_result(end.value)
            self._end_request()
        except InvalidHandle:
            self._end_request(NoAnswer(self._gone_reason()))
        except Exception as error:  # for the caller, not for the executor of the robot
            self._end_request(error)

    def _await_futures(self, futures: Sequence[Future[Any]]) -> None:
        """Go on when all of these are done."""
        for each in futures:
            if not each.done():
                Future.add_done_callback(each, lambda _: self._await_futures(futures))
                return
        self._resume_steps()

    def _send(self) -> None:
        """Send the request if its service is available: DDS drops messages without a reader."""
        with self._lock:  # the asking thread and the client's may meet here
            call = self._step
            if self._over or self._sent is not None or not isinstance(call, Call):
                return
            if self._connection.gone():
                return
            self._endpoints = endpoints = self._connection.endpoints()
            self._sent = sent = endpoints.send(call)
            self._seen = time.monotonic()
        if sent is None:
            self._connection.line.watch(self)  # soon
        else:
            sent.add_done_callback(self._heard)

    def _heard(self, sent: Any) -> None:
        try:
            self._resume_steps(sent.result())
        except Exception as error:  # of rclpy
            self._end_request(error)

    def _set_error(self, error: Exception) -> None:
        with suppress(InvalidStateError):  # it has its answer
            self.set_exception(error)

    def _end_request(self, error: Exception | None = None) -> None:
        """End for good."""
        if error is not None:
            self._set_error(error)
        with suppress(InvalidStateError):
            self.freed.set_result(None)
        with suppress(ValueError):  # it runs
            self._steps.close()
        if self._endpoints is not None and isinstance(self._step, Call):
            self._endpoints.drop_call(self._step, self._sent)

    # --- in the client's thread -------------------------------------------------------------

    @property
    def due(self) -> float:
        """When to look at it: soon if it is not sent, since no event tells of new services."""
        if isinstance(self._step, Call) and self._sent is None:
            return 0.0
        return math.inf if self.done() else self._until

    def look(self, now: float) -> bool:
        """Send what could not be sent yet, give up what is hopeless or late; return whether there
        is more to come.
        """
        if (endpoints := self._endpoints) is not None and not self.done():
            self._connection.report_wait(endpoints, self._what, now - self._begun)
            if not endpoints.serving:
                self._until += now - self._looked
        self._looked = now
        try:
            self._send()
            if reason := self._failure_reason(now):
                self._end_request(NoAnswer(reason))
        except Exception as error:
            gone = isinstance(error, InvalidHandle) and NoAnswer(self._gone_reason())
            self._end_request(gone or error)
        if now > self._until:
            late = f'did not answer {self._what} within {self._timeout:g} s'
            why = f': {endpoints.held_up}' if endpoints is not None and endpoints.held_up else ''
            self._set_error(NoAnswer(f'{self._connection.peer} {late}{why}'))
            if (
                not (self._lasting and self._has_reached_node())
                or now > self._until + 600.0  # the result may come 600 s late
            ):
                self._end_request()
        return not self.freed.done()

    def _gone_reason(self) -> str:
        return f'{self._connection.peer}: {self._connection.gone()} during {self._what}'

    def _failure_reason(self, now: float) -> str:
        """Return why there will be no answer; empty while there may be one."""
        if self._connection.gone():
            return self._gone_reason()
        peer = self._connection.peer
        with self._lock:
            call, sent, asked = self._step, self._sent, self._asked
        if not isinstance(call, Call):
            return ''
        if sent is None or self._endpoints is None:
            if now - asked <= self._patience:
                return ''
            return (
                f'no memory node answers as {peer} within {self._patience:g} s; start one '
                'with "ros2 run mlmem_ros memory_node", and check ROS_DOMAIN_ID and the name'
            )
        if self._endpoints.ready(call):
            self._seen = now
        # the service is missing from the graph for longer
        if now - self._seen > 1.0 or self._endpoints.is_silent():
            return f'{peer} went away during {self._what}: how it ended is not known'
        return ''


class Turn:
    """Suspends a coroutine, of rclpy or asyncio, until another thread tells it to go on."""

    def __init__(self, connection: NodeConnection) -> None:
        self._connection = connection
        self._future: Any
        try:
            self._loop = asyncio.get_running_loop()
            self._future = self._loop.create_future()
        except RuntimeError:  # an executor runs the coroutine
            self._future = RclpyFuture(executor=connection.node.executor)

    def tell(self, _: Any = None) -> None:
        """Have it go on; from any thread."""
        if isinstance(self._future, RclpyFuture):
            self._future.set_result(None)
        else:
            with suppress(RuntimeError):  # the loop is closed
                self._loop.call_soon_threadsafe(self._resume_future)
        self._connection.wake()

    def _resume_future(self) -> None:
        if not self._future.done():  # or cancelled with its task
            self._future.set_result(None)

    def __await__(self) -> Generator[Any, None, None]:
        while not self._future.done():  # an executor that asyncio spins resumes it earlier
            self._future._asyncio_future_blocking = True
            yield self._future


def check_seconds(name: str, value: Any) -> float:
    """Return a time above 0.

    Raises:
        ValueError: It is none.
    """
    if isinstance(value, bool) or not isinstance(value, Real) or not float(value) > 0.0:
        raise ValueError(f'{name} must be above 0 s; got {short_repr(value)}')
    return float(value)
