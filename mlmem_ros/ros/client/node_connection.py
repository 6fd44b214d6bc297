# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How a client reaches its memory node: services and topics over one hidden node, or the next."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from functools import partial
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.client import Client
from rclpy.node import Node

from ..middleware import (
    ALIVE,
    HEARTBEAT_PROFILE,
    KEEP_ALL_PROFILE,
    RELIABLE_PROFILE,
)
from .client_thread import HiddenNode, find_end, get_client_thread

REPORT_PERIOD_S = 5.0
"""Time between two log lines on what a memory node waits for."""

MAX_SILENCE_S = 4.0
"""Seconds without a heartbeat after which a memory node is given up."""


class NodeConnection:
    """How a client reaches its memory node, and whether that lives.

    Attributes:
        node: The robot's node.
        peer: Full name of the memory node.
        patience: Seconds to wait for it to appear.
        thread: The thread in which its requests live.
        hidden: The hidden node with its ROS entities; none before the first request.
        status: The last heartbeat; its message is what the memory node waits for or prepares.
    """

    def __init__(self, node: Node, peer: str, patience: float) -> None:
        self.node = node
        self.peer = peer
        self.patience = patience
        self.thread = get_client_thread()
        self.hidden: HiddenNode | None = None
        self.status = DiagnosticStatus()
        self._clients: dict[str, Client] = {}
        self._receivers: dict[str, set[Callable[[Any], None]]] = {}
        self._last_sign = math.inf  # a heartbeat, or its discovery
        self._came_back = False
        self._reported = '', -math.inf  # what the node waits for, and when that was logged

    def find_end(self) -> str:
        """Return why nothing can come any more; empty while it can."""
        return 'ROS was shut down' if self.thread.closed else find_end(self.node)

    # --- in the client's thread -------------------------------------------------------------

    def get_node(self) -> Node:
        """Return the hidden node, a new one if memory node and client may not be connected."""
        broken = self.hidden
        if broken is None or self._came_back or self.is_silent():
            self.hidden = hidden = self.thread.get_hidden_node(self.node, broken)
            hidden.users.add(self)
            if broken is not None:
                broken.users.discard(self)
            self._clients, self._receivers, self.status = {}, {}, DiagnosticStatus()
            self._last_sign, self._came_back = math.inf, False
            hidden.node.create_subscription(
                DiagnosticStatus,
                f'{self.peer}/{ALIVE}',
                partial(self._take_heartbeat, hidden),
                HEARTBEAT_PROFILE,
            )
        assert self.hidden is not None
        return self.hidden.node

    def is_silent(self) -> bool:
        """Return whether the memory node was there and has given no heartbeat for long."""
        node = self.hidden and self.hidden.node
        if node and self._last_sign == math.inf and node.count_publishers(f'{self.peer}/{ALIVE}'):
            self._last_sign = time.monotonic()
        return time.monotonic() - self._last_sign > MAX_SILENCE_S

    def has_service(self, service: str) -> bool:
        """Return whether the memory node has a service, as far as is known."""
        return bool(self.get_node().count_services(f'{self.peer}/{service}'))

    def get_client(self, service: str, kind: Any) -> Client:
        """Return the client of a service, created on first use since each slows the node."""
        node = self.get_node()
        if service not in self._clients:
            self._clients[service] = node.create_client(
                kind, f'{self.peer}/{service}', qos_profile=KEEP_ALL_PROFILE
            )
        return self._clients[service]

    def get_receivers(self, topic: str, kind: Any) -> set[Callable[[Any], None]]:
        """Return who is given the messages of a topic of the memory node, to be changed."""
        node = self.get_node()
        if topic not in self._receivers:
            receivers = self._receivers[topic] = set()

            def deliver_message(message: Any) -> None:
                for each in list(receivers):
                    each(message)

            node.create_subscription(
                kind, f'{self.peer}/{topic}', deliver_message, RELIABLE_PROFILE
            )
        return self._receivers[topic]

    def report_wait(self, what: str, begun: float) -> None:
        """Log what the memory node prepares, if it does, while a request waits since a time."""
        now, text = time.monotonic(), self.status.message
        before, logged = self._reported
        if text and (text != before or now - logged >= REPORT_PERIOD_S):
            self._reported = text, now
            seconds = f'{now - begun:.0f} s'
            self.node.get_logger().info(f'{what} waits for {self.peer}: {text} ({seconds})')

    def _take_heartbeat(self, hidden: HiddenNode, status: DiagnosticStatus) -> None:
        """Take note of a heartbeat.

        A node that comes back before anybody asks whether it is silent has stood still as well,
        and may have forgotten this client, which receives its heartbeats all the same.
        """
        if hidden is self.hidden:
            now = time.monotonic()
            self._came_back |= now - self._last_sign > MAX_SILENCE_S
            self._last_sign, self.status = now, status
