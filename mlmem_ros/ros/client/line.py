# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The line to memory nodes: a thread of the client's own that delivers answers, and heals itself.

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
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar
from weakref import WeakKeyDictionary, ref

import rclpy
from rclpy.context import Context
from rclpy.event_handler import SubscriptionEventCallbacks, UnsupportedEventTypeError
from rclpy.exceptions import InvalidHandle
from rclpy.executors import Executor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future
from rclpy.timer import Timer
from std_msgs.msg import Empty

from ..events import events_executor
from ..qos import ALIVE, CLIENTS, EVERY_ONE, HEARD, RELIABLE, heard_within

if TYPE_CHECKING:
    from .reply import Reply

SOON = 0.05
"""Seconds between two looks at the graph while a request waits for its service to appear."""

LOOK = 0.5
"""Seconds between two looks at clock and graph otherwise."""

LEASE = 2.0
"""Seconds without a sign of life after which the middleware says so."""

GRACE = 2.0
"""Seconds after which that is believed."""

DESCRIBES = 'start_type_description_service'
"""A parameter of every node of rclpy."""

PATIENCE = 10.0
"""Seconds to wait for the end of the thread."""

DESTROYED = InvalidHandle, rclpy_implementation.RCLError
"""What rclpy raises when the node is destroyed, or ROS was shut down."""

ASLEEP = 10.0
"""Seconds that this process may stand still before others may have forgotten it."""


@dataclass(frozen=True)
class Call:
    """One service call: the service below the memory node's name, its type, and the request.

    Without a request it only waits until the service is available.
    """

    service: str
    kind: Any
    request: Any = None


class Connection:
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
        self.line = Line.of(node.context)
        self._link: Link | None = None
        self._lock = threading.Lock()

    def wake(self, _: Any = None) -> None:
        """Have the robot's executor, if there is one, resume its coroutines.

        The executor of events does so only after a callback of the node.
        """
        executor = self.node.executor
        if isinstance(executor, Executor):
            executor.wake()
        elif executor is not None:
            with contextlib.suppress(*DESTROYED):
                timers: list[Timer] = []  # it may fire before it is in here, and then fires again

                def end() -> None:
                    while timers:
                        self.node.destroy_timer(timers.pop())

                timers.append(self.node.create_timer(0.0, end))

    def link(self) -> Link:
        """Return the link, a new one if the last is broken."""
        with self._lock:
            if self._link is None or self._link.broken:
                broken, line = self._link, self.line
                if broken is not None:
                    line = self.line.renewed(broken, self.node)
                    broken.close()
                self._link = Link(line, self.node, self.peer)
            return self._link

    def gone(self) -> str:
        """Return why nothing can come any more; empty while it can."""
        if not self.node.context.ok() or self.line.over:
            return 'ROS was shut down'
        return 'the node was destroyed' if is_destroyed(self.node) else ''


class Link:
    """A memory node as it is reached over one line: the ROS entities for it, and whether it lives.

    Attributes:
        node: The hidden node.
    """

    def __init__(self, line: Line, robot: Node, peer: str) -> None:
        self._line = line
        self._peer = peer
        self._lost = False
        self._clients: dict[str, Any] = {}
        self._heard: dict[str, Any] = {}
        self._takers: dict[str, set[Callable[[Any], None]]] = {}
        self._lock = threading.Lock()
        self._alive, self._since = 0, time.monotonic() + LEASE
        self._met = False
        self.node = line.join(self, robot)
        self.node.create_publisher(Empty, f'{peer}/{CLIENTS}', heard_within(HEARD))
        callbacks = SubscriptionEventCallbacks(
            liveliness=self._on_liveliness, use_default_callbacks=False
        )
        with contextlib.suppress(UnsupportedEventTypeError):  # then only the graph tells
            self._heard[ALIVE] = self.node.create_subscription(
                Empty, f'{peer}/{ALIVE}', _ignore, heard_within(LEASE), event_callbacks=callbacks
            )

    @property
    def broken(self) -> bool:
        """Whether it was silent for so long that it may have to be reached anew."""
        return self._lost or self._line.broken

    def ready(self, call: Call) -> bool:
        """Return whether the service of a call is available."""
        ready: bool = self._client(call).service_is_ready()
        return ready

    def send(self, call: Call) -> Future | None:
        """Send a request; return its response to come, or none if it cannot be sent yet."""
        if self.silent(time.monotonic()) or not self.ready(call):
            return None
        if call.request is not None:
            return self._client(call).call_async(call.request)
        there = Future()
        there.set_result(None)
        return there

    def drop(self, call: Call, sent: Future | None) -> None:
        """Take no interest in a response any more."""
        with contextlib.suppress(InvalidHandle):
            if sent is not None:
                self._client(call).remove_pending_request(sent)

    def takers(self, topic: str, kind: Any) -> set[Callable[[Any], None]]:
        """Return who is given the messages of a topic of the memory node, to be changed."""
        with self._lock:
            if topic not in self._takers:
                self._takers[topic] = takers = set[Callable[[Any], None]]()

                def take(message: Any) -> None:
                    for each in list(takers):
                        each(message)

                self._heard[topic] = self.node.create_subscription(
                    kind, f'{self._peer}/{topic}', take, RELIABLE
                )
                self._line.stir()
            return self._takers[topic]

    def _client(self, call: Call) -> Any:
        """Return the rclpy client of a service, created on first use since each slows the node."""
        with self._lock:
            if call.service not in self._clients:
                self._clients[call.service] = self.node.create_client(
                    call.kind, f'{self._peer}/{call.service}', qos_profile=EVERY_ONE
                )
                self._line.stir()
            return self._clients[call.service]

    def serves(self, service: str) -> bool:
        """Return whether the memory node has a service, as far as is known."""
        return bool(self.node.count_services(f'{self._peer}/{service}'))

    def silent(self, now: float) -> bool:
        """Return whether the memory node has given no sign of life for long; then it is broken."""
        if not self._alive and ALIVE in self._heard:
            if not self._met:  # the first sign follows the discovery
                self._met = self.node.count_publishers(f'{self._peer}/{ALIVE}') > 0
                self._since = now + LEASE
            elif now - self._since > GRACE:
                self._lost = True
        return self._lost

    def close(self) -> None:
        """Leave the line. The entities stay until it ends: the executor may hold an event of one
        that another thread destroys, and crash.
        """
        self._line.leave(self)

    def _on_liveliness(self, event: Any) -> None:
        self._alive, self._since = event.alive_count, time.monotonic()


class Line:
    """A thread that spins the hidden nodes of a context's clients, and looks after their replies.

    Attributes:
        context: The context.
        broken: Whether this process has slept for so long that others may have forgotten it.
        over: Whether it ends, or has ended.
    """

    _all: ClassVar[WeakKeyDictionary[Context, Line]] = WeakKeyDictionary()
    _making = threading.RLock()

    def __init__(self, context: Context, own: bool = False) -> None:
        """Start; a line that owns its context ends it when the last link has left."""
        self.context = context
        self.broken = False
        self._own = own
        self._newest = self
        self._executor = events_executor(context)
        self._nodes: dict[ref[Node], Node] = {}
        self._links: set[Link] = set()
        self._left: set[Link] = set()
        self._pending: set[Reply[Any]] = set()
        self._next = 0.0  # when it looks at them
        self.over = self._ended = False
        self._lock = threading.RLock()
        self._woken = Future()
        self._thread = threading.Thread(target=self._run, name='mlmem-client', daemon=True)
        self._thread.start()
        atexit.register(self.close)

    @classmethod
    def of(cls, context: Context) -> Line:
        """Return the line of a robot's context."""
        with cls._making:
            if context not in cls._all:
                cls._all[context] = cls(context)
            return cls._all[context]

    def renewed(self, broken: Link, robot: Node) -> Line:
        """Return a line in place of that of a broken link, with a participant of its own."""
        with self._making:
            if self._newest.has(broken) or self._newest.over:
                self._newest = Line(_context_like(robot), own=True)
                self.context.on_shutdown(self._newest.close)
            return self._newest

    def has(self, link: Link) -> bool:
        """Return whether a link belongs to this line."""
        return link in self._links

    def join(self, link: Link, robot: Node) -> Node:
        """Return the hidden node for a robot's node."""
        with self._lock:
            self._links.add(link)
            if (known := ref(robot)) not in self._nodes:
                self._nodes[known] = node = Node(
                    f'_{robot.get_name()}_mlmem', namespace=robot.get_namespace(),
                    context=self.context, use_global_arguments=False,
                    start_parameter_services=False, enable_rosout=False,
                    parameter_overrides=[Parameter(DESCRIBES, value=False)],
                )  # fmt: skip
                self._executor.add_node(node)
            return self._nodes[known]

    def leave(self, link: Link) -> None:
        """Forget a link."""
        with self._lock:
            self._left.add(link)
            if self._own and self._left == self._links:
                self.close(join=False)

    def watch(self, reply: Reply[Any]) -> None:
        """Look after a reply from now on."""
        with self._lock:
            if not (ended := self._ended):
                self._pending.add(reply)
                if reply.due < self._next:
                    self.stir()
        if ended:  # the thread looks no more
            reply.look(time.monotonic())

    @property
    def here(self) -> bool:
        """Whether this is the thread that delivers the answers."""
        return threading.current_thread() is self._thread

    def stir(self) -> None:
        """Have the thread look."""
        with self._lock:
            self._woken.set_result(None)

    def close(self, join: bool = True) -> None:
        """End the thread, and with it what pends."""
        self.over = True
        self.stir()
        if self._newest is not self:
            self._newest.close(join)
        if join and not self.here:
            self._thread.join(PATIENCE)

    # --- in its thread ---------------------------------------------------------------------

    def _run(self) -> None:
        seen = _since_boot()
        while not self.over and self.context.ok():
            turn = self._pause()
            with contextlib.suppress(Exception):  # a message that cannot be decoded
                self._executor.spin_until_future_complete(self._woken, turn)
            with self._lock:
                if self._woken.done():
                    self._woken = Future()
            before, seen = seen, _since_boot()
            self.broken |= seen - before > turn + ASLEEP
            self._look()
        with self._lock:
            self._ended = True
        self._look()
        atexit.unregister(self.close)
        self._executor.shutdown()
        for node in list(self._nodes.values()):
            node.destroy_node()
        if self._own:
            rclpy.try_shutdown(context=self.context)

    def _pause(self) -> float:
        """Return the seconds until the next look."""
        with self._lock:
            now = time.monotonic()
            due = min((reply.due for reply in self._pending), default=now + LOOK)
            self._next = min(max(due, now + SOON), now + LOOK)
            return self._next - now

    def _look(self) -> None:
        now = time.monotonic()
        with self._lock:
            pending = list(self._pending)
            for known, hidden in list(self._nodes.items()):
                if (robot := known()) is None or is_destroyed(robot):
                    hidden.destroy_node()
                    del self._nodes[known]
        ended = {reply for reply in pending if not reply.look(now)}
        with self._lock:
            self._pending -= ended


def is_destroyed(node: Node) -> bool:
    """Return whether a node is no more."""
    try:
        with node.handle:
            return False
    except InvalidHandle:
        return True


def _context_like(robot: Node) -> Context:
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


def _since_boot() -> float:
    """Return the seconds since the machine was started, those in which it slept included."""
    return time.clock_gettime(getattr(time, 'CLOCK_BOOTTIME', time.CLOCK_MONOTONIC))


def _ignore(_: Empty) -> None:
    """Take nothing from a topic whose publisher only lives."""
