# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How clients reach their memory nodes: through a thread, in which their requests live.

All clients in a ROS context share a node of their own, which the thread spins. So answers come
whether or not anybody spins the robot's node. Other threads hand functions over to its executor,
and nothing of a request is locked.
"""

from __future__ import annotations

import atexit
import math
import os
import threading
import time
from collections.abc import Callable
from typing import Any, ClassVar

import rclpy
from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.action import ActionClient
from rclpy.client import Client
from rclpy.context import Context
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.signals import SignalHandlerOptions

from ...contract.topics import Qos
from ..middleware import create_events_executor

CLIENT_THREAD_NAME = 'mlmem-client'
"""Name of the threads that take answers."""


class ClientThread(threading.Thread):
    """Spins the node of the clients in a context, and resumes their requests.

    It ends with the context, or when Python ends.

    Attributes:
        node: The node, which has the ROS entities of the clients.
        requests: The requests that pend: every `RequestReply` that it resumes when it is due.
        closed: Whether it has ended.
    """

    _lock = threading.Lock()
    _newest: ClassVar[dict[Context, ClientThread]] = {}

    def __init__(self, node: Node, context: Context) -> None:
        """Spin a node for the clients in a robot's context."""
        super().__init__(name=CLIENT_THREAD_NAME, daemon=True)
        self.node = node
        self.requests: set[Any] = set()
        self.closed = self._is_closing = False
        self._context = context
        self._links: dict[str, MemoryLink] = {}
        self._executor = create_events_executor(node.context)
        self._executor.add_node(node)
        self._newest[context] = self
        context.on_shutdown(self._executor.wake)
        atexit.register(self.close)  # Python's end aborts who is in C++ then
        self.start()

    @classmethod
    def accept(cls, request: Any, context: Context, peer: str) -> None:
        """Take a request of a robot's context on, with its `link` to a memory node.

        The node of the clients is hidden in the robot's context, and no further participant. A
        memory node that stands still (SIGSTOP, swap, a debugger) is forgotten by others after a
        while, and may forget them. If only one side forgets, Fast DDS never connects them again.
        So after such a time, requests go through a new participant of the clients' own.
        """
        with cls._lock:
            thread = cls._newest.get(context)
            if thread is None:
                thread = cls(_create_hidden_node(context), context)
            elif peer in thread._links and thread._links[peer].is_interrupted():
                own = Context()  # in the enclave that the command line names
                domain = thread.node.context.get_domain_id()
                no_handlers = SignalHandlerOptions.NO
                rclpy.init(context=own, domain_id=domain, signal_handler_options=no_handlers)
                thread = cls(_create_hidden_node(own), context)
            if peer not in thread._links:
                thread._links[peer] = MemoryLink(thread, peer)
            request.link = thread._links[peer]
            thread.requests.add(request)
        thread.post(request.resume)

    def post(self, function: Callable[[], object]) -> None:
        """Have the thread call a function, after those posted before, unless it has ended."""
        if not self.closed:
            self._executor.create_task(function)

    def close(self) -> None:
        """End the thread, and with it what pends."""
        self._is_closing = True
        self.post(self._executor.wake)
        self.join(10.0)

    def run(self) -> None:
        """Spin the node until the end of the robot's context, then leave the ROS graph."""
        while not self._is_over():
            begun = time.monotonic()
            due = min((each.due for each in tuple(self.requests)), default=math.inf)
            timeout = min(max(due - begun, 0.0), 0.5)
            self._spin_once(timeout)
            now = time.monotonic()
            if now - begun > timeout + 0.5:  # this process stood still
                for each in tuple(self.requests):  # what has arrived meanwhile comes first
                    each.due = max(each.due, now + 0.5)
            for each in tuple(self.requests):
                if each.due <= now:
                    each.resume()
        with self._lock:
            self.closed = True
            if self._newest.get(self._context) is self:
                del self._newest[self._context]
        for each in tuple(self.requests):
            each.resume()
        self._executor.shutdown()
        self.node.destroy_node()
        if self.node.context is not self._context:
            rclpy.try_shutdown(context=self.node.context)
        atexit.unregister(self.close)  # last: until here Python's end waits for this thread

    def _is_over(self) -> bool:
        """Return whether the robot has left ROS, or a successor of another context serves it."""
        replaced = self._newest.get(self._context) is not self
        is_own = self.node.context is not self._context
        idle = is_own and replaced and not self.requests
        return self._is_closing or idle or not self._context.ok()

    def _spin_once(self, timeout: float) -> None:
        try:
            self._executor.spin_once(timeout_sec=timeout)
        except Exception as error:  # a message that cannot be decoded, a callback of `standalone`
            if self._context.ok():
                text = f'a callback failed: {error!r}'
                self.node.get_logger().error(text, throttle_duration_sec=1.0)


def _create_hidden_node(context: Context) -> Node:
    return Node(
        f'_{create_node_name()}', context=context, use_global_arguments=False,
        start_parameter_services=False, enable_rosout=False,
        parameter_overrides=[Parameter('start_type_description_service', value=False)],
    )  # fmt: skip


def create_node_name() -> str:
    """Return the name of a client's node, which no other has."""
    return f'mlmem_client_{os.getpid()}_{time.time_ns() % 10**6}'


class MemoryLink:
    """What the clients of a thread share to reach one memory node, and whether that lives.

    Attributes:
        thread: The thread in which the requests live.
        status: The last heartbeat; its message is what the memory node waits for or prepares.
        reported: The last message of a heartbeat that was logged.
    """

    def __init__(self, thread: ClientThread, peer: str) -> None:
        """Listen to the heartbeat of a memory node, given by its full name."""
        self.thread = thread
        self.status = DiagnosticStatus()
        self.reported = ''
        self._peer = peer
        self._clients: dict[str, Any] = {}
        self._last_sign = math.inf  # a heartbeat, or the node's discovery
        self._came_back = False
        self.thread.node.create_subscription(
            DiagnosticStatus, f'{peer}/alive', self._take_heartbeat, Qos.HEARTBEAT.profile
        )

    def is_silent(self) -> bool:
        """Return whether the memory node was there and has given no heartbeat for 4 s."""
        return time.monotonic() - self._last_sign > 4.0

    def is_interrupted(self) -> bool:
        """Return whether memory node and clients may have forgotten each other.

        A node that came back before anybody asked may have forgotten the clients as well, though
        they receive its heartbeats.
        """
        return self._came_back or self.is_silent()

    def expect_heartbeat(self) -> None:
        """Take note that the memory node is there."""
        self._last_sign = min(self._last_sign, time.monotonic())

    def serves_action(self, name: str) -> bool:
        """Return whether the memory node serves an action, as far as is known."""
        return bool(self.thread.node.count_services(f'{self._peer}/{name}/_action/send_goal'))

    def get_client(self, service: str, kind: Any) -> Client:
        """Return the client of a service, created on first use since each slows the node."""
        if service not in self._clients:
            self._clients[service] = self.thread.node.create_client(
                kind, f'{self._peer}/{service}', qos_profile=Qos.KEEP_ALL.profile
            )
        client: Client = self._clients[service]
        return client

    def get_action_client(self, name: str, kind: Any) -> ActionClient:
        """Return the client of an action, created on first use."""
        key = f'action {name}'
        if key not in self._clients:
            names = (f'{each}_service_qos_profile' for each in ('goal', 'result', 'cancel'))
            qos = dict.fromkeys(names, Qos.KEEP_ALL.profile)
            node, path = self.thread.node, f'{self._peer}/{name}'
            self._clients[key] = ActionClient(node, kind, path, **qos)
        return self._clients[key]

    def _take_heartbeat(self, status: DiagnosticStatus) -> None:
        self._came_back = self.is_interrupted()
        self._last_sign, self.status = time.monotonic(), status
