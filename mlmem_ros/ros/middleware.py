# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The middleware: qualities of service, and ways around two traps, for executors and for signs of
life of nodes.

rclpy's own function for an executor of events turns on a fault handler, which needs a stderr that
is a file; notebooks and captured tests have none. DDS has liveliness. But with a finite lease, a
timer of Fast DDS takes the lock of its discovery; a peer that leaves in that moment holds it and
waits for the timer (issue 6502): of 1300 clients of a busy machine, one ended a node so.
"""

from __future__ import annotations

import atexit
import threading
from collections.abc import Callable
from typing import ClassVar

import rclpy
from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.context import Context
from rclpy.exceptions import InvalidHandle
from rclpy.executors import Executor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.logging import LoggingSeverity
from rclpy.node import Node
from rclpy.publisher import Publisher

from ..contract.topics import Qos


def create_events_executor(context: Context | None = None) -> Executor:
    """Return an executor that builds no wait set and takes only microseconds for a callback.

    It ignores callback groups, and without a time-out it waits for ever.
    """
    context = context or rclpy.get_default_context()
    executor: Executor = rclpy_implementation.EventsExecutor(context)
    context.on_shutdown(executor.wake)
    return executor


def write_log_line(name: str, severity: str, text: str) -> None:
    """Write a line under the name of a logger; the severity is INFO, WARN or ERROR.

    A node's logger looks for the line of code that calls it, which takes 0.4 ms, longer than a
    tick, and whoever waits for an answer waits for it.
    """
    number = LoggingSeverity[severity]
    rclpy_implementation.rclpy_logging_rcutils_log(number, name, text, '', '', 0)


DESTROYED_ERRORS = InvalidHandle, rclpy_implementation.RCLError
"""What rclpy raises when a node is destroyed, or ROS was shut down."""


class Heartbeat:
    """Publishes signs of life of nodes once a second, from a thread of its own.

    Executors may be busy, and the graph forgets a killed node late. The level STALE is that of a
    node that prepares: requests wait until it serves.
    """

    _publishers: ClassVar[dict[Publisher, Callable[[], DiagnosticStatus]]] = {}
    _lock = threading.Lock()
    _over = threading.Event()
    _thread = threading.Thread()

    @classmethod
    def start_heartbeat(cls, node: Node, status: Callable[[], DiagnosticStatus]) -> None:
        """Give signs on `~/alive` until the node is destroyed, each with its present status."""
        with cls._lock:
            publisher = node.create_publisher(DiagnosticStatus, '~/alive', Qos.HEARTBEAT.profile)
            cls._publishers[publisher] = status
            if not cls._thread.is_alive():
                cls._thread = threading.Thread(target=cls._run, name='mlmem-alive', daemon=True)
                cls._thread.start()

    @classmethod
    def _run(cls) -> None:
        atexit.register(cls._thread.join)  # Python's end aborts who is in C++ then
        atexit.register(cls._over.set)
        while not cls._over.wait(1.0):
            with cls._lock:
                for publisher, status in list(cls._publishers.items()):
                    try:
                        publisher.publish(status())
                    except DESTROYED_ERRORS:
                        del cls._publishers[publisher]
