# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How clients reach their memory nodes: hidden nodes, and the thread of a process that spins them.

The ROS entities of clients are on hidden nodes. One executor spins them in this thread, so answers
come whether or not anybody spins the robot's node. Requests live in this thread only; other
threads hand functions over to it, so that nothing of a request is locked.
"""

from __future__ import annotations

import atexit
import contextlib
import math
import threading
import time
from collections.abc import Callable
from functools import cache, partial
from typing import Any, Protocol
from weakref import ref

import rclpy
from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.client import Client
from rclpy.context import Context
from rclpy.exceptions import InvalidHandle
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.signals import SignalHandlerOptions

from ...contract.topics import Qos
from ..middleware import ALIVE, create_events_executor

CHECK_PERIOD_S = 0.5
"""Seconds between two looks at clock and graph."""


class PendingRequest(Protocol):
    """A request that the thread resumes when it is `due` on the monotonic clock."""

    due: float

    def resume(self) -> None:
        """Go on, if what it waits for has come, is late or is hopeless."""


class HiddenNode:
    """A hidden node, through which the clients on a robot's node reach their memory nodes.

    Attributes:
        robot: The robot's node, or None if it was collected.
        node: The hidden node.
        users: The connections whose ROS entities are on it.
    """

    def __init__(self, robot: Node, context: Context | None) -> None:
        """Create it in the robot's context, as no further participant, or in one of its own."""
        self.robot = ref(robot)
        self.users: set[object] = set()
        self._own_context = context
        self.node = Node(
            f'_{robot.get_name()}_mlmem', namespace=robot.get_namespace(),
            context=context or robot.context, use_global_arguments=False,
            start_parameter_services=False, enable_rosout=False,
            parameter_overrides=[Parameter('start_type_description_service', value=False)],
        )  # fmt: skip

    def destroy(self) -> None:
        """Destroy it, and its context if that is its own."""
        self.node.destroy_node()
        if self._own_context is not None:
            rclpy.try_shutdown(context=self._own_context)


class ClientThread:
    """Spins the hidden nodes of a process, and resumes its requests.

    Attributes:
        closed: Whether it has ended, as Python does.
    """

    def __init__(self) -> None:
        self.closed = self._over = False
        self._context = Context()  # of the executor alone: it has no participant
        self._context.init([], initialize_logging=False)
        self._executor = create_events_executor(self._context)
        self._hidden: list[HiddenNode] = []
        self._replies: set[PendingRequest] = set()
        self._thread = threading.Thread(
            target=self._run_requests, name='mlmem-client', daemon=True
        )
        self._thread.start()
        atexit.register(self.close)  # Python's end aborts who is in C++ then

    @property
    def is_current_thread(self) -> bool:
        """Whether this is the thread that delivers the answers."""
        return threading.current_thread() is self._thread

    def post(self, function: Callable[[], object]) -> None:
        """Have the thread call a function, after those posted before."""
        if self.closed:
            function()
        else:
            self._executor.create_task(function)

    def leave_graph(self) -> None:
        """Return once requests and hidden nodes of robots that are gone have ended."""
        left = threading.Event()
        self.post(lambda: self._check_all(math.inf))
        self.post(lambda: self.post(left.set))  # after what was posted meanwhile
        if not self.is_current_thread:
            left.wait(10.0)

    def close(self) -> None:
        """End the thread, and with it what pends."""
        self._over = True
        self._executor.wake()
        self._thread.join(10.0)

    # --- in its thread ---------------------------------------------------------------------

    def watch_request(self, reply: PendingRequest) -> None:
        """Resume a pending reply whenever it is due, from now on."""
        self._replies.add(reply)

    def get_hidden_node(self, robot: Node, broken: HiddenNode | None = None) -> HiddenNode:
        """Return the newest hidden node of a robot's node, a new one if that is a broken one.

        A node that stands still (SIGSTOP, swap, a debugger) is forgotten by others after a while,
        and may forget them. If only one side forgets, Fast DDS never connects them again. So what
        was silent for long is reached by a participant of the client's own from then on.
        """
        newest = self._find_newest(robot)
        if newest is None or newest is broken:
            newest = HiddenNode(robot, broken and _create_context_like(robot))
            self._executor.add_node(newest.node)
            self._hidden.append(newest)
        return newest

    def _find_newest(self, robot: Node | None) -> HiddenNode | None:
        return next((each for each in self._hidden[::-1] if each.robot() is robot), None)

    def _run_requests(self) -> None:
        checked = 0.0
        while not self._over:
            begun = time.monotonic()
            due = min((each.due for each in self._replies), default=math.inf)
            timeout = min(max(due - begun, 0.0), CHECK_PERIOD_S)
            self._spin_once(timeout)
            now = time.monotonic()
            if now - begun > timeout + CHECK_PERIOD_S:  # this process stood still
                for each in self._replies:  # what has arrived meanwhile comes first
                    each.due = max(each.due, now + CHECK_PERIOD_S)
            if now - checked > CHECK_PERIOD_S or due <= now:
                self._check_all(now)
                checked = now
        self.closed = True
        self._check_all(math.inf)
        self._executor.create_task(self._context.try_shutdown)
        while self._context.ok():
            self._spin_once(CHECK_PERIOD_S)
        self._executor.shutdown()

    def _spin_once(self, timeout: float) -> None:
        with contextlib.suppress(Exception):  # a message that cannot be decoded
            self._executor.spin_once(timeout_sec=timeout)

    def _check_all(self, now: float) -> None:
        """Resume what is due; destroy hidden nodes that have no robot or a successor."""
        for each in [each for each in self._replies if each.due <= now]:
            each.resume()
        self._replies = {each for each in self._replies if each.due < math.inf}
        for hidden in list(self._hidden):
            robot = hidden.robot()
            if (
                self.closed
                or robot is None
                or find_end(robot)
                or not (hidden.users or hidden is self._find_newest(robot))
            ):
                self._hidden.remove(hidden)
                self._executor.remove_node(hidden.node)  # it may hold events of it until then
                self._executor.create_task(hidden.destroy)


@cache
def get_client_thread() -> ClientThread:
    """Return the thread of this process."""
    return ClientThread()


def find_end(robot: Node) -> str:
    """Return why nothing can come to a node any more; empty while it can."""
    if not robot.context.ok():
        return 'ROS was shut down'
    try:
        with robot.handle:
            return ''
    except InvalidHandle:
        return 'the node was destroyed'


def _create_context_like(robot: Node) -> Context:
    """Return a context in the domain and the enclave of a node."""
    me = robot.get_name(), robot.get_namespace()
    known = robot.get_node_names_and_namespaces_with_enclaves()
    enclave = next((enclave for *name, enclave in known if (*name,) == me), '/')
    context = Context()
    rclpy.init(
        args=['--ros-args', '--enclave', enclave],
        context=context,
        domain_id=robot.context.get_domain_id(),
        signal_handler_options=SignalHandlerOptions.NO,
    )
    return context


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
                Qos.HEARTBEAT.profile,
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
                kind, f'{self.peer}/{service}', qos_profile=Qos.KEEP_ALL.profile
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
                kind, f'{self.peer}/{topic}', deliver_message, Qos.RELIABLE.profile
            )
        return self._receivers[topic]

    def report_wait(self, what: str, begun: float) -> None:
        """Log what the memory node prepares, if it does, while a request waits since a time."""
        now, text = time.monotonic(), self.status.message
        before, logged = self._reported
        if text and (text != before or now - logged >= 5.0):
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
