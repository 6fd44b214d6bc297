# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The executor of a process of nodes: it survives any message, and signals wake it."""

from __future__ import annotations

import signal
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager

from rclpy.context import Context
from rclpy.node import Node
from rclpy.task import Future

from ...host import ThrottledLog
from ..events import events_executor

MOST = 1000
"""Requests taken at once from a service, after one that could not be decoded."""


class GuardedExecutor:
    """Spins nodes, whose callbacks let no exception out; what raises is a message."""

    def __init__(self, context: Context | None = None) -> None:
        self._events = events_executor(context)
        self._logs: dict[Node, ThrottledLog] = {}
        self._interrupted = Future()

    def add_node(self, node: Node, log: ThrottledLog) -> None:
        """Spin a node from now on, and log what cannot be decoded in its journal."""
        self._logs[node] = log
        self._events.add_node(node)

    def turn(self, seconds: float) -> None:
        """Run callbacks for a time, or until interrupted."""
        try:
            self._events.spin_until_future_complete(self._interrupted, seconds)
        except Exception as error:  # the executor forgets requests that came with it
            for node, log in self._logs.items():
                _refuse(log, error)
                _catch_up(node, log)
        if self._interrupted.done():
            self._interrupted = Future()

    def interrupt(self) -> None:
        """End this turn, or the next one; from any thread."""
        self._interrupted.set_result(None)

    @contextmanager
    def woken_by_signals(self) -> Iterator[None]:
        """Let every signal that Python handles end a spin of the main thread.

        Python runs a handler in the main thread once it returns from the middleware's wait, which
        signals do not interrupt. But the interpreter writes a byte when a signal comes, and our
        thread that waits for this byte wakes the executor.
        """
        ours, interpreters = socket.socketpair()
        interpreters.setblocking(False)
        before = signal.set_wakeup_fd(interpreters.fileno(), warn_on_full_buffer=False)

        def wake() -> None:
            while ours.recv(1):
                self.interrupt()

        thread = threading.Thread(target=wake, name='mlmem-signals', daemon=True)
        thread.start()
        try:
            yield
        finally:
            signal.set_wakeup_fd(before)
            interpreters.close()  # which the thread reads as the end
            thread.join()
            ours.close()

    def shutdown(self) -> None:
        """Stop running callbacks."""
        self._events.shutdown()


def _refuse(log: ThrottledLog, error: Exception) -> None:
    log.refused('a message', f'it cannot be decoded: {error}')


def _catch_up(node: Node, log: ThrottledLog) -> None:
    """Serve the requests that wait. Topics need no catching up: we take their bytes."""
    for service in node.services:
        for _ in range(MOST):
            try:
                request, header = service.handle.service_take_request(service.srv_type.Request)
            except Exception as error:
                _refuse(log, error)
            else:
                if request is None:
                    break
                answer = service.callback(request, service.srv_type.Response())
                service.send_response(answer, header)
