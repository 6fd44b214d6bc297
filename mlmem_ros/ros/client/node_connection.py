# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How a client reaches its memory node: service calls and topics over one line, or the next."""

from __future__ import annotations

import contextlib
import math
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.exceptions import InvalidHandle
from rclpy.executors import Executor
from rclpy.node import Node
from rclpy.task import Future
from rclpy.timer import Timer

from ..middleware import (
    ALIVE,
    DESTROYED_ERRORS,
    HEARTBEAT_PROFILE,
    KEEP_ALL_PROFILE,
    NOT_SERVING,
    RELIABLE_PROFILE,
)
from .client_thread import ClientThread, is_destroyed

REPORT_PERIOD_S = 5.0
"""Time between two log lines on what a memory node waits for."""

MAX_SILENCE_S = 4.0
"""Seconds without a sign of life after which a memory node is given up."""


@dataclass(frozen=True)
class Call:
    """One service call: the service below the memory node's name, its type, and the request.

    Without a request it only waits until the service is available.
    """

    service: str
    kind: Any
    request: Any = None


class NodeConnection:
    """How a client reaches its memory node.

    Attributes:
        node: The robot's node.
        peer: Full name of the memory node.
        patience: Seconds to wait for it to appear.
    """

    def __init__(self, node: Node, peer: str, patience: float) -> None:
        self.node = node
        self.peer = peer
        self.patience = patience
        self.line = ClientThread.of(node.context)
        self._endpoints: NodeEndpoints | None = None
        self._lock = threading.Lock()
        self._reported = '', -math.inf  # what the node waits for, and when that was logged

    def report_wait(self, endpoints: NodeEndpoints, what: str, seconds: float) -> None:
        """Log what the memory node waits for while a request has waited for some seconds."""
        now, text = time.monotonic(), endpoints.held_up
        before, logged = self._reported
        if text and (text != before or now - logged >= REPORT_PERIOD_S):
            self._reported = text, now
            self.node.get_logger().info(f'{what} waits for {self.peer}: {text} ({seconds:.0f} s)')

    def wake(self, _: Any = None) -> None:
        """Have the robot's executor, if there is one, resume its coroutines.

        The executor of events does so only after a callback of the node.
        """
        executor = self.node.executor
        if isinstance(executor, Executor):
            executor.wake()
        elif executor is not None:
            with contextlib.suppress(*DESTROYED_ERRORS):
                timers: list[Timer] = []  # it may fire before it is in here, and then fires again

                def destroy_timers() -> None:
                    while timers:
                        self.node.destroy_timer(timers.pop())

                timers.append(self.node.create_timer(0.0, destroy_timers))

    def endpoints(self) -> NodeEndpoints:
        """Return the endpoints, new ones if the last are broken."""
        with self._lock:
            if self._endpoints is None or self._endpoints.broken:
                broken, line = self._endpoints, self.line
                if broken is not None:
                    line = self.line.replace_broken(broken, self.node)
                    broken.close()
                self._endpoints = NodeEndpoints(line, self.node, self.peer)
            return self._endpoints

    def gone(self) -> str:
        """Return why nothing can come any more; empty while it can."""
        if not self.node.context.ok() or self.line.over:
            return 'ROS was shut down'
        return 'the node was destroyed' if is_destroyed(self.node) else ''


class NodeEndpoints:
    """A memory node as it is reached over one line: the ROS entities for it, and whether it lives.

    Attributes:
        node: The hidden node.
    """

    def __init__(self, line: ClientThread, robot: Node, peer: str) -> None:
        self._line = line
        self._peer = peer
        self._lost = False
        self._clients: dict[str, Any] = {}
        self._topics: dict[str, Any] = {}
        self._takers: dict[str, set[Callable[[Any], None]]] = {}
        self._lock = threading.Lock()
        self._since = line.awake
        self._met = self._heard = False
        self.node = line.join(self, robot)
        self._status = DiagnosticStatus()
        self._signs = self.node.create_subscription(
            DiagnosticStatus, f'{peer}/{ALIVE}', self._on_heartbeat, HEARTBEAT_PROFILE
        )

    @property
    def serving(self) -> bool:
        """Whether the memory node serves requests, as far as is known; else it prepares."""
        return bool(self._status.level != NOT_SERVING)

    @property
    def held_up(self) -> str:
        """What the memory node says that it waits for or prepares; empty if it only serves."""
        return str(self._status.message)

    @property
    def broken(self) -> bool:
        """Whether it was silent for so long that it may have to be reached anew."""
        return self._lost or self._line.broken

    def ready(self, call: Call) -> bool:
        """Return whether the service of a call is available."""
        ready: bool = self._get_client(call).service_is_ready()
        return ready

    def send(self, call: Call) -> Future | None:
        """Send a request; return its response to come, or none if it cannot be sent yet."""
        if self.is_silent() or not self.ready(call):
            return None
        if call.request is not None:
            return self._get_client(call).call_async(call.request)
        there = Future()
        there.set_result(None)
        return there

    def drop_call(self, call: Call, sent: Future | None) -> None:
        """Take no interest in a response any more."""
        with contextlib.suppress(InvalidHandle):
            if sent is not None:
                self._get_client(call).remove_pending_request(sent)

    def find_receivers(self, topic: str, kind: Any) -> set[Callable[[Any], None]]:
        """Return who is given the messages of a topic of the memory node, to be changed."""
        with self._lock:
            if topic not in self._takers:
                self._takers[topic] = takers = set[Callable[[Any], None]]()

                def deliver_message(message: Any) -> None:
                    for each in list(takers):
                        each(message)

                self._topics[topic] = self.node.create_subscription(
                    kind, f'{self._peer}/{topic}', deliver_message, RELIABLE_PROFILE
                )
                self._line.wake_thread()
            return self._takers[topic]

    def _get_client(self, call: Call) -> Any:
        """Return the rclpy client of a service, created on first use since each slows the node."""
        with self._lock:
            if call.service not in self._clients:
                self._clients[call.service] = self.node.create_client(
                    call.kind, f'{self._peer}/{call.service}', qos_profile=KEEP_ALL_PROFILE
                )
                self._line.wake_thread()
            return self._clients[call.service]

    def has_service(self, service: str) -> bool:
        """Return whether the memory node has a service, as far as is known."""
        return bool(self.node.count_services(f'{self._peer}/{service}'))

    def is_silent(self) -> bool:
        """Return whether the memory node has given no sign of life for long; then it is broken."""
        if not self._met:  # the first sign follows the discovery
            self._met = self.node.count_publishers(f'{self._peer}/{ALIVE}') > 0
            self._since = self._line.awake
        elif self._line.awake - self._since > MAX_SILENCE_S:
            self._lost = True
        return self._lost

    def close(self) -> None:
        """Leave the thread. The entities stay until it ends: the executor may hold an event of one
        that another thread destroys, and crash.
        """
        self._line.remove_link(self)

    def _on_heartbeat(self, status: DiagnosticStatus) -> None:
        """Take note of a sign of life.

        A node that comes back before anybody asks whether it is silent has stood still as well,
        and may have forgotten this client, which hears it all the same.
        """
        now = self._line.awake
        if self._heard and now - self._since > MAX_SILENCE_S:
            self._lost = True
        self._since, self._heard, self._status = now, True, status
