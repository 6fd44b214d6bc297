# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A request under way, in the client's thread: a generator that yields when it waits."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import Future, InvalidStateError
from contextlib import suppress
from typing import Any, TypeVar

from ...contract.calls import NoAnswer, RequestError
from ..middleware import NOT_SERVING
from .client_thread import CHECK_PERIOD_S
from .node_connection import NodeConnection

T = TypeVar('T')

POLL_PERIOD_S = 0.02
"""Seconds between two looks for a missing service: no event tells of new ones."""

MAX_DELAY_S = 600.0
"""Seconds for which an answer is awaited that came too late for its client."""

Steps = Generator[float, None, T]
"""What leads to an answer: it yields the seconds to wait at most, and may be resumed earlier."""


class Request:
    """A request of a client.

    Attributes:
        connection: How it reaches the memory node.
        what: What it asks for, in words.
        freed: Done when the node has nothing more to do with it, as far as is known: later than
            the answer, if that was given up.
        is_sent: Whether the node may have begun with it.
        due: When to resume it, on the monotonic clock; infinite once it is over.
    """

    def __init__(
        self,
        connection: NodeConnection,
        what: str,
        steps: Callable[[Request], Steps[T]],
        timeout: float,
        patience: float,
        answer: Future[T],
    ) -> None:
        self.connection, self.what = connection, what
        self.freed: Future[None] = Future()
        self.is_sent = False
        self._timeout, self._patience = timeout, min(patience, timeout)
        self._answer = answer
        self.due = self._begun = time.monotonic()
        self._deadline = self._begun + timeout  # later, if the node prepares meanwhile
        self._steps: Steps[Any] = steps(self)

    def start(self) -> None:
        """Send it, or wait until that is possible."""
        self.connection.thread.watch(self)
        self.resume()

    def resume(self, _: Any = None) -> None:
        """Go on, if what it waits for has come, is late or is hopeless."""
        now = time.monotonic()
        if now > self._deadline:
            late = f'did not answer {self.what} within {self._timeout:g} s'
            why = f': {held_up}' if (held_up := self.connection.status.message) else ''
            _settle(self._answer, NoAnswer(f'{self.connection.peer} {late}{why}'))
            self.give_up()
        if self.freed.done():
            return
        try:
            if self.connection.find_end() or now > self._deadline + MAX_DELAY_S:
                raise self._describe_end()
            period = next(self._steps)
        except StopIteration as end:
            self._end(end.value)
        except Exception as error:  # for the caller
            known = isinstance(error, RequestError) or not self.connection.find_end()
            self._end(error if known else self._describe_end())
        else:
            left = math.inf if self._answer.done() else self._deadline - now
            self.due = now + max(min(period, left), 0.0)

    def give_up(self) -> None:
        """End, if it was not sent; otherwise the node's answer is awaited all the same."""
        if not self.is_sent:
            self._end(None)

    def wait_for(self, futures: Sequence[Future[Any]]) -> Steps[None]:
        """Wait until all futures are done."""
        for each in futures:
            Future.add_done_callback(each, lambda _: self.connection.thread.post(self.resume))
        while not all(each.done() for each in futures):
            yield math.inf

    def call(self, service: str, kind: Any, message: Any = None) -> Steps[Any]:
        """Call a service below the memory node's name; return its response.

        Without a message, wait until the service is available.

        Raises:
            NoAnswer: It is not available within the patience, or the node went away.
        """
        begun = time.monotonic()
        while not (client := self.connection.get_client(service, kind)).service_is_ready():
            if time.monotonic() - begun > self._patience:
                raise NoAnswer(
                    f'no memory node answers as {self.connection.peer} within '
                    f'{self._patience:g} s; start one with "ros2 run mlmem_ros memory_node", and '
                    'check ROS_DOMAIN_ID and the name'
                )
            yield from self._wait_for_node(POLL_PERIOD_S)
        if message is None:  # DDS drops messages without a reader
            return None
        self.is_sent, hidden = True, self.connection.hidden
        response = client.call_async(message)
        response.add_done_callback(self.resume)
        ready = time.monotonic()
        try:
            while not response.done():
                yield from self._wait_for_node(CHECK_PERIOD_S)
                now = time.monotonic()
                ready = now if client.service_is_ready() else ready
                away = now - ready > 1.0  # longer than the graph may take
                if away or self.connection.is_silent() or self.connection.hidden is not hidden:
                    raise NoAnswer(
                        f'{self.connection.peer} went away during {self.what}: how it ended is '
                        'not known'
                    )
            return response.result()
        finally:
            client.remove_pending_request(response)

    def _wait_for_node(self, period: float) -> Steps[None]:
        """Wait for at most a period; time in which the node prepares does not count."""
        begun = time.monotonic()
        yield period
        if not self._answer.done():
            self.connection.report_wait(self.what, self._begun)
            if self.connection.status.level == NOT_SERVING:
                self._deadline += time.monotonic() - begun

    def _describe_end(self) -> NoAnswer:
        end = self.connection.find_end() or 'no answer has come'
        return NoAnswer(f'{self.connection.peer}: {end} during {self.what}')

    def _end(self, outcome: Any) -> None:
        """End for good, with an answer or an error."""
        self.due = math.inf
        self._steps.close()
        _settle(self._answer, outcome)
        _settle(self.freed, None)


def _settle(future: Future[Any], outcome: Any) -> None:
    """Give a future its result or its error, unless it has one."""
    with suppress(InvalidStateError):
        if isinstance(outcome, Exception):
            future.set_exception(outcome)
        else:
            future.set_result(outcome)
