# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The memory in a program without a node of its own."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import rclpy
from rclpy.context import Context
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future

from ...contract.calls import NoAnswer
from ..middleware import events_executor
from .client import MemoryClient
from .line import Line

POLL = 0.02
"""Seconds between two checks of a condition."""

TURN = 10.0
"""Seconds per spin; this executor must not wait without a time-out."""


@contextmanager
def standalone(name: str = 'mlmem', patience: float = 10.0) -> Iterator[MemoryClient]:
    """Join the ROS graph with a client, its node and a thread that spins it; leave it at the end.

    ::

        with standalone() as memory:
            memory.write(5).wait()

    It has its own context and no signal handlers, so it does not disturb the program's rclpy.
    Callbacks of subscriptions created on `memory.node` run in its thread. The memory node may take
    `patience` seconds to appear.
    """
    context = Context()
    rclpy.init(context=context, signal_handler_options=SignalHandlerOptions.NO)
    node = Node(
        f'mlmem_client_{os.getpid()}_{time.time_ns() % 10**6}',
        context=context,
        use_global_arguments=False,
        start_parameter_services=False,
    )
    executor = events_executor(context)
    executor.add_node(node)
    over = Future()

    def turn() -> None:
        while not over.done():
            executor.spin_until_future_complete(over, TURN)

    thread = threading.Thread(target=turn, name='mlmem-client', daemon=True)
    thread.start()
    try:
        yield MemoryClient(node, name, patience=patience)
    finally:
        over.set_result(None)
        thread.join()  # an executor must not be shut down while it spins
        executor.shutdown()
        Line.of(context).close()
        node.destroy_node()
        rclpy.try_shutdown(context=context)


def wait_until(condition: Callable[[], object], what: str, timeout: float = 10.0) -> None:
    """Wait in the program's thread until a condition holds, which the client's callbacks may make
    true.

    Raises:
        NoAnswer: It does not become true in time.
    """
    deadline = time.monotonic() + timeout
    while not condition():
        if time.monotonic() > deadline:
            raise NoAnswer(f'{what} did not come within {timeout:g} s')
        time.sleep(POLL)
