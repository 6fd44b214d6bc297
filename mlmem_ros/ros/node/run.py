# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Running memory nodes, one or several in a process, from start to last answer."""

from __future__ import annotations

import gc
import signal
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack

import rclpy
from rclpy.context import Context
from rclpy.exceptions import ParameterException
from rclpy.logging import get_logger
from rclpy.signals import SignalHandlerOptions

from ...host import REFUSALS
from ..deadline import exit_within
from .executor import GuardedExecutor
from .node import MemoryNode

ENDED, NOT_STARTED, NOT_SAVED = 0, 1, 3
"""Exit status: ended on request; could not start; ended on request, but the content or recording
could not be saved. (2 is a wrong command line.)"""

POLL = 10.0
"""Seconds per turn of the executor, which must not wait without a time-out."""

QUIET = 0.5
"""Seconds without a client after which none is expected any more."""

LAST_ANSWERS = 1.0
"""Longest time in seconds for answering pending requests when the nodes end."""

MOMENT = 0.01
"""Seconds in which the executor takes what has arrived."""

LEAVE = 5.0
"""Seconds for leaving the ROS graph. All is saved by then: a middleware that hangs is cut off."""

DELIVERY = 0.2
"""Seconds for the middleware to deliver these answers before it is shut down."""

Element = Mapping[str, str]
"""What distinguishes a node from others in its process: its `namespace`, and parameters."""

ONE: Sequence[Element] = ({},)


def run(arguments: Sequence[str], stop: Sequence[int], elements: Sequence[Element] = ONE) -> int:
    """Run memory nodes until a signal has been received, which its handler adds to `stop`; return
    `ENDED`, `NOT_STARTED` or `NOT_SAVED`.
    """
    try:
        nodes, executor = begin(arguments, elements=elements)
    except (*REFUSALS, ParameterException, ImportError) as error:
        get_logger('mlmem').fatal(f'cannot start: {error}')
        rclpy.try_shutdown()
        return NOT_STARTED
    except Exception as error:
        if type(error).__module__.startswith('rclpy'):  # a malformed parameter file, a bad remap
            why = str(error).splitlines()[0]
            if type(error).__name__ == 'UnknownROSArgsError':
                why = f'after --ros-args there must be only ROS options; got {why}'
            get_logger('mlmem').fatal(f'cannot start: {why}')
            return NOT_STARTED
        raise
    gc.freeze()  # or collecting the compiler's garbage stops time for 70 ms
    with ExitStack() as pages:
        for node in nodes:
            if node.get_parameter('view').value:
                from ...packages import tool  # most nodes have no page
                from ..node_process import child

                view = ['view', '--node', node.get_fully_qualified_name()]
                pages.enter_context(child(tool('command_line').module, view))
        with executor.woken_by_signals():
            turn(executor, stop)
            linger(nodes, executor, stop)
        for number in (signal.SIGINT, signal.SIGTERM):  # a second signal must not cut this short
            signal.signal(number, signal.SIG_IGN)
        return end(nodes, executor, lambda status: exit_within(LEAVE, status))


def begin(
    arguments: Sequence[str],
    context: Context | None = None,
    kind: type[MemoryNode] = MemoryNode,
    elements: Sequence[Element] = ONE,
) -> tuple[list[MemoryNode], GuardedExecutor]:
    """Return nodes with their executor, active if they autostart.

    If one of several cannot start, it logs why and the others run.

    Raises:
        What keeps the first from starting, if none can start.
    """
    rclpy.init(
        args=list(arguments), context=context, signal_handler_options=SignalHandlerOptions.NO
    )
    executor = GuardedExecutor(context)
    nodes: list[MemoryNode] = []
    refused: list[Exception] = []
    try:
        for element in elements:
            try:
                node = _made(kind, context, element)
                executor.add_node(node, node.host.log)
                nodes.append(node)
                if node.get_parameter('autostart').value:
                    node.begin()
            except Exception as error:
                refused.append(error)
                if len(refused) == len(elements):
                    raise refused[0] from None
                where = element.get('namespace', '')
                get_logger('mlmem').error(f'{where} cannot start: {error}')
    except BaseException:
        for node in nodes:
            node.close()
        executor.shutdown()
        for node in nodes:
            node.destroy_node()
        raise
    return nodes, executor


def _made(kind: type[MemoryNode], context: Context | None, element: Element) -> MemoryNode:
    given = dict(element)
    namespace = given.pop('namespace', None)
    return kind(context=context, namespace=namespace, parameters=given)


def turn(executor: GuardedExecutor, stop: Sequence[object]) -> None:
    """Let nodes work until `stop` is not empty and the executor is interrupted."""
    while not stop:
        executor.turn(POLL)


def linger(nodes: Sequence[MemoryNode], executor: GuardedExecutor, stop: Sequence[int]) -> None:
    """After SIGINT, let nodes work until no client is left, SIGTERM comes, or for their `linger`.

    A terminal and launch stop a robot and its memory together, and the robot may want to write a
    last time.
    """
    longest = max(node.get_parameter('linger').value for node in nodes)
    if longest and signal.SIGTERM not in stop:
        nodes[0].get_logger().info(f'serving for at most {longest:g} s, until no client is left')
    begun = seen = now = time.monotonic()
    while signal.SIGTERM not in stop and now - begun < longest and now - seen < QUIET:
        executor.turn(0.1 * QUIET)
        now = time.monotonic()
        if any(node.client_count for node in nodes):
            seen = now


def end(
    nodes: Sequence[MemoryNode],
    executor: GuardedExecutor,
    leaving: Callable[[int], None] = lambda status: None,
) -> int:
    """Save, answer all requests, then call `leaving`, and leave the ROS graph; return the exit
    status.
    """
    executor.turn(MOMENT)  # takes what was sent during the start
    answered = sum(node.answered for node in nodes)
    pending = any(node.waiting for node in nodes)
    with ThreadPoolExecutor(len(nodes)) as closers:  # a hung disk affects only one element
        list(closers.map(MemoryNode.close, nodes))
    deadline = time.monotonic() + LAST_ANSWERS
    executor.turn(MOMENT)  # refuses what was sent meanwhile
    while any(node.waiting for node in nodes) and time.monotonic() < deadline:
        executor.turn(MOMENT)  # they are refused, but not answered yet
    if pending or answered < sum(node.answered for node in nodes):
        time.sleep(DELIVERY)
    for node in nodes:
        node.get_logger().info('shut down; not all was saved' if node.host.lost else 'shut down')
    status = NOT_SAVED if any(node.host.lost for node in nodes) else ENDED
    leaving(status)
    executor.shutdown()
    for node in nodes:
        node.destroy_node()
    rclpy.try_shutdown(context=nodes[0].context)
    return status
