# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The thread of a client's own, which delivers answers and heals itself.

A client's ROS entities are on a hidden node of its own, in the robot's context, so that the robot
has no further participant; its executor runs in a thread of its own. So answers come whether or
not anybody spins the robot's node.

A node that stands still (SIGSTOP, swap, a debugger) is forgotten by others after a while, and may
forget them. If only one side forgets, Fast DDS never connects them again. So what was silent for
long is reached over a participant of the client's own from then on.
"""

from __future__ import annotations

import atexit
import contextlib
import threading
import time
from typing import ClassVar, Protocol
from weakref import WeakKeyDictionary, ref

import rclpy
from rclpy.context import Context
from rclpy.exceptions import InvalidHandle
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future

from ..middleware import create_events_executor

CHECK_PERIOD_S = 0.5
"""Seconds between two looks at clock and graph otherwise."""


class Pending(Protocol):
    """What the thread looks after, such as a reply."""

    @property
    def due(self) -> float:
        """When to look at it, on the monotonic clock."""

    def look(self, now: float) -> bool:
        """Do what is due; return whether there is more to come."""


class ClientThread:
    """A thread that spins the hidden nodes of a context's clients, and looks after their replies.

    Attributes:
        context: The context.
        broken: Whether this process has slept for so long that others may have forgotten it.
        awake: Seconds for which it has listened: not while this process stood still.
        over: Whether it ends, or has ended.
    """

    _all: ClassVar[WeakKeyDictionary[Context, ClientThread]] = WeakKeyDictionary()
    _making = threading.RLock()

    def __init__(self, context: Context, own: bool = False) -> None:
        """Start; one that owns its context ends it when the last link has left."""
        self.context = context
        self.broken = False
        self.awake = 0.0
        self._own = own
        self._newest = self
        self._executor = create_events_executor(context)
        self._nodes: dict[ref[Node], Node] = {}
        self._links: set[object] = set()
        self._left: set[object] = set()
        self._pending: set[Pending] = set()
        self._next = 0.0  # when it looks at them
        self.over = self._ended = False
        self._lock = threading.RLock()
        self._woken = Future()
        self._thread = threading.Thread(target=self._run, name='mlmem-client', daemon=True)
        self._thread.start()
        atexit.register(self.close)

    @classmethod
    def of(cls, context: Context) -> ClientThread:
        """Return the thread of a robot's context."""
        with cls._making:
            if context not in cls._all:
                cls._all[context] = cls(context)
            return cls._all[context]

    def replace_broken(self, broken: object, robot: Node) -> ClientThread:
        """Return a thread in place of that of a broken link, with a participant of its own."""
        with self._making:
            if self._newest.has_link(broken) or self._newest.over:
                self._newest = ClientThread(_create_context_like(robot), own=True)
                self.context.on_shutdown(self._newest.close)
            return self._newest

    def has_link(self, link: object) -> bool:
        """Return whether a link belongs to this thread."""
        return link in self._links

    def join(self, link: object, robot: Node) -> Node:
        """Return the hidden node for a robot's node."""
        with self._lock:
            self._links.add(link)
            if (known := ref(robot)) not in self._nodes:
                self._nodes[known] = node = Node(
                    f'_{robot.get_name()}_mlmem', namespace=robot.get_namespace(),
                    context=self.context, use_global_arguments=False,
                    start_parameter_services=False, enable_rosout=False,
                    parameter_overrides=[Parameter('start_type_description_service', value=False)],
                )  # fmt: skip
                self._executor.add_node(node)
            return self._nodes[known]

    def remove_link(self, link: object) -> None:
        """Forget a link."""
        with self._lock:
            self._left.add(link)
            if self._own and self._left == self._links:
                self.close(join=False)

    def watch(self, pending: Pending) -> None:
        """Look after something from now on."""
        with self._lock:
            if not (ended := self._ended):
                self._pending.add(pending)
                if pending.due < self._next:
                    self.wake_thread()
        if ended:  # the thread looks no more
            pending.look(time.monotonic())

    @property
    def is_current_thread(self) -> bool:
        """Whether this is the thread that delivers the answers."""
        return threading.current_thread() is self._thread

    def wake_thread(self) -> None:
        """Have the thread look."""
        with self._lock:
            self._woken.set_result(None)

    def close(self, join: bool = True) -> None:
        """End the thread, and with it what pends."""
        self.over = True
        self.wake_thread()
        if self._newest is not self:
            self._newest.close(join)
        if join and not self.is_current_thread:
            self._thread.join(10.0)

    # --- in its thread ---------------------------------------------------------------------

    def _run(self) -> None:
        seen = _seconds_since_boot()
        while not self.over and self.context.ok():
            turn = self._schedule_check()
            with contextlib.suppress(Exception):  # a message that cannot be decoded
                self._executor.spin_until_future_complete(self._woken, turn)
            with self._lock:
                if self._woken.done():
                    self._woken = Future()
            before, seen = seen, _seconds_since_boot()
            self.awake += min(seen - before, turn + CHECK_PERIOD_S)
            # others may have forgotten a process that stood still for longer
            self.broken |= seen - before > turn + 10.0
            self._check_pending()
        with self._lock:
            self._ended = True
        self._check_pending()
        self._executor.shutdown()
        for node in list(self._nodes.values()):
            node.destroy_node()
        if self._own:
            rclpy.try_shutdown(context=self.context)
        atexit.unregister(self.close)  # last: Python's end aborts who is in C++ then

    def _schedule_check(self) -> float:
        """Return the seconds until the next look."""
        with self._lock:
            now = time.monotonic()
            due = min((each.due for each in self._pending), default=now + CHECK_PERIOD_S)
            # a missing service is looked for every 20 ms
            self._next = min(max(due, now + 0.02), now + CHECK_PERIOD_S)
            return self._next - now

    def _check_pending(self) -> None:
        now = time.monotonic()
        with self._lock:
            pending, self._next = list(self._pending), 0.0  # a pause follows anyhow
            for known, hidden in list(self._nodes.items()):
                if (robot := known()) is None or is_destroyed(robot):
                    hidden.destroy_node()
                    del self._nodes[known]
        ended = {each for each in pending if not each.look(now)}
        with self._lock:
            self._pending -= ended


def is_destroyed(node: Node) -> bool:
    """Return whether a node is no more."""
    try:
        with node.handle:
            return False
    except InvalidHandle:
        return True


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


def _seconds_since_boot() -> float:
    """Return the seconds since the machine was started, those in which it slept included."""
    return time.clock_gettime(getattr(time, 'CLOCK_BOOTTIME', time.CLOCK_MONOTONIC))
