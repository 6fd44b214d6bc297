# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The thread of a process that takes the answers for all its clients.

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
from functools import cache
from typing import TYPE_CHECKING
from weakref import ref

import rclpy
from rclpy.context import Context
from rclpy.exceptions import InvalidHandle
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.signals import SignalHandlerOptions

from ..middleware import create_events_executor

if TYPE_CHECKING:
    from .request import Request

CHECK_PERIOD_S = 0.5
"""Seconds between two looks at clock and graph."""


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
        self._requests: set[Request] = set()
        self._thread = threading.Thread(target=self._run, name='mlmem-client', daemon=True)
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

    def watch(self, request: Request) -> None:
        """Resume a request whenever it is due, from now on."""
        self._requests.add(request)

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

    def _run(self) -> None:
        checked = 0.0
        while not self._over:
            begun = time.monotonic()
            due = min((each.due for each in self._requests), default=math.inf)
            timeout = min(max(due - begun, 0.0), CHECK_PERIOD_S)
            self._spin_once(timeout)
            now = time.monotonic()
            if now - begun > timeout + CHECK_PERIOD_S:  # this process stood still
                for each in self._requests:  # what has arrived meanwhile comes first
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
        for each in [each for each in self._requests if each.due <= now]:
            each.resume()
        self._requests = {each for each in self._requests if each.due < math.inf}
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
