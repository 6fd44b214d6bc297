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
from rclpy.logging import get_logger
from rclpy.signals import SignalHandlerOptions

from ...host import REFUSALS
from .executor import GuardedExecutor
from .node import MemoryNode
from .page import page
from .parameters import ParameterError
from .signal_wakeup import woken_by_signals

ENDED, NOT_STARTED, NOT_SAVED = 0, 1, 3
"""Exit status: it ended because it was asked to; it could not be started; it ended because it was
asked to, and content or recording could not be saved. (2 is a wrong command line.)"""

POLL = 10.0
"""Seconds of a turn: to wait without a time-out is not safe."""

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
            turn(executor, stop)
        for number in (signal.SIGINT, signal.SIGTERM):  # a second one must not cut this short
            signal.signal(number, signal.SIG_IGN)
        return end(node, executor)


def begin(
    arguments: Sequence[str],
    context: Context | None = None,
    kind: type[MemoryNode] = MemoryNode,
) -> tuple[MemoryNode, GuardedExecutor]:
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
    executor = GuardedExecutor(context)
    executor.add_node(node, node.host.journal)
    try:
        if node.get_parameter('autostart').value:
            node.start()
    except BaseException:
        node.close()
        executor.shutdown()
        node.destroy_node()
        raise
    return node, executor


def turn(executor: GuardedExecutor, stop: Sequence[object]) -> None:
    """Let nodes work until there is anything in `stop`, and the executor is interrupted."""
    while not stop:
        executor.turn(POLL)


def end(node: MemoryNode, executor: GuardedExecutor) -> int:
    """Save, answer who waits, and leave the ROS graph; return the exit status."""
    told = not node.waiting
    node.close()
    deadline = time.monotonic() + LAST_ANSWERS
    while node.waiting and time.monotonic() < deadline:  # they are refused, and not told yet
        executor.turn(0.01)
    if not told:
        time.sleep(DELIVERY)
    status = NOT_SAVED if node.host.lost else ENDED
    node.get_logger().info('shut down' if status == ENDED else 'shut down; not all was saved')
    executor.shutdown()
    node.destroy_node()
    rclpy.try_shutdown(context=node.context)
    return status
