# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Running a memory node: from its start to its last answer."""

from __future__ import annotations

import gc
import signal
import time
from collections.abc import Sequence

import rclpy
from rclpy.context import Context
from rclpy.exceptions import ParameterException
from rclpy.executors import Executor
from rclpy.logging import get_logger
from rclpy.signals import SignalHandlerOptions

from ...host import REFUSALS
from .boundary import GuardedExecutor
from .node import MemoryNode
from .page import page
from .parameters import ParameterError
from .signal_wakeup import woken_by_signals

ENDED, NOT_STARTED, NOT_SAVED = 0, 1, 3
"""Exit status: it ended because it was asked to; it could not be started; it ended because it was
asked to, and content or recording could not be saved. (2 is a wrong command line.)"""

POLL = 1.0
"""Seconds between two looks whether the device has failed."""

LAST_ANSWERS = 1.0
"""Longest time in seconds for telling those who wait that the node ends."""

DELIVERY = 0.2
"""Seconds left to the middleware to deliver these answers before it is shut down."""


def run(arguments: Sequence[str], stop: Sequence[int]) -> int:
    """Run one memory node until a signal has been received.

    Args:
        arguments: Command line with ROS arguments.
        stop: The signals received so far; whoever handles them adds to it.

    Returns:
        Exit status: `ENDED`, `NOT_STARTED` or `NOT_SAVED`.
    """
    try:
        node, executor = begin(arguments)
    except (*REFUSALS, ParameterError, ParameterException) as error:
        get_logger('mlmem').fatal(f'cannot start: {error}')
        rclpy.try_shutdown()
        return NOT_STARTED
    except Exception as error:
        if type(error).__module__.startswith('rclpy'):  # a malformed parameter file, a bad remap
            why = str(error).splitlines()[0]
            if type(error).__name__ == 'UnknownROSArgsError':
                why = f'behind --ros-args there must be options of ROS alone; got {why}'
            get_logger('mlmem').fatal(f'cannot start: {why}')
            return NOT_STARTED
        raise
    gc.freeze()  # or going through what the compiler has left behind stops time for 70 ms
    with page(node):
        with woken_by_signals(executor):
            turn(node, executor, stop)
        for number in (signal.SIGINT, signal.SIGTERM):  # a second one must not cut this short
            signal.signal(number, signal.SIG_IGN)
        return end(node, executor)


def begin(
    arguments: Sequence[str],
    context: Context | None = None,
    kind: type[MemoryNode] = MemoryNode,
) -> tuple[MemoryNode, Executor]:
    """Return a node with its executor, active if it starts itself.

    Args:
        arguments: Command line with ROS arguments.
        context: ROS's, by default the one of the process.
        kind: The class of the node.

    Raises:
        Whatever it cannot start for.
    """
    rclpy.init(
        args=list(arguments), context=context, signal_handler_options=SignalHandlerOptions.NO
    )
    node = kind(context=context)
    executor = GuardedExecutor(node.host.journal, context=context)
    executor.add_node(node)
    try:
        if node.get_parameter('autostart').value:
            node.start()
    except BaseException:
        node.close()
        executor.shutdown()
        node.destroy_node()
        raise
    return node, executor


def turn(node: MemoryNode, executor: Executor, stop: Sequence[object]) -> None:
    """Let a node work until there is anything in `stop`."""
    while not stop:
        executor.spin_once(timeout_sec=POLL)
        node.mind_failure()


def end(node: MemoryNode, executor: Executor) -> int:
    """Save, answer who waits, and leave the ROS graph; return the exit status."""
    node.close()
    deadline = time.monotonic() + LAST_ANSWERS
    told = not node.waiting
    while node.waiting and time.monotonic() < deadline:  # they are refused, and not told yet
        executor.spin_once(timeout_sec=0.0)
    if not told:
        time.sleep(DELIVERY)
    status = NOT_SAVED if node.host.lost else ENDED
    node.get_logger().info('shut down' if status == ENDED else 'shut down; not all was saved')
    executor.shutdown()
    node.destroy_node()
    rclpy.try_shutdown(context=node.context)
    return status
