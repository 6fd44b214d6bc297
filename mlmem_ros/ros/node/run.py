# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Running memory nodes, one or several in a process, from start to last answer.

Their executor survives any message.
"""

from __future__ import annotations

import contextlib
import faulthandler
import gc
import os
import signal
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor

import rclpy
from rclpy.context import Context
from rclpy.logging import get_logger
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future

from ...host import REFUSALS, ThrottledLog
from ..middleware import create_events_executor
from ..node_process import ignore_signals
from .node import MemoryNode

ENDED, NOT_STARTED, NOT_SAVED = 0, 1, 3
"""Exit status: ended on request; could not start; ended on request, but the content or recording
could not be saved. (2 is a wrong command line.)"""

CLIENT_ABSENCE_S = 0.5
"""Seconds without a client after which none is expected any more."""

LEAVE_TIMEOUT_S = 5.0
"""Seconds for leaving the ROS graph. All is saved by then: a middleware that hangs is cut off,
with a traceback and exit status 1."""

NodeOptions = Mapping[str, str]
"""What distinguishes a node from others in its process: its `namespace`, and parameters."""


def run_nodes(
    arguments: Sequence[str], stop: Sequence[int], elements: Sequence[NodeOptions] = ({},)
) -> int:
    """Run memory nodes until a signal has been received, which its handler adds to `stop`; return
    `ENDED`, `NOT_STARTED` or `NOT_SAVED`.
    """
    try:
        nodes, executor = start_nodes(arguments, elements=elements, stop=stop)
    except Exception as error:
        of_rclpy = type(error).__module__.startswith('rclpy')  # a bad parameter file or remapping
        if not (of_rclpy or isinstance(error, (*REFUSALS, ImportError))):
            raise
        why = str(error).splitlines()[0] if of_rclpy else str(error)
        if type(error).__name__ == 'UnknownROSArgsError':
            why = f'after --ros-args there must be only ROS options; got {why}'
        get_logger('mlmem').fatal(f'cannot start: {why}')
        rclpy.try_shutdown()
        return NOT_STARTED
    gc.freeze()  # or collecting the compiler's garbage stops time for 70 ms
    spin_nodes(executor, stop)
    await_last_clients(nodes, executor, stop)
    ignore_signals()
    status = end_nodes(nodes, executor, lambda: exit_within(LEAVE_TIMEOUT_S))
    if any(node.host.preparing for node in nodes):  # Python cannot end while LLVM compiles
        os._exit(status)
    return status


def start_nodes(
    arguments: Sequence[str],
    context: Context | None = None,
    kind: type[MemoryNode] = MemoryNode,
    elements: Sequence[NodeOptions] = ({},),
    stop: Sequence[int] = (),
) -> tuple[list[MemoryNode], GuardedExecutor]:
    """Return nodes with their executor, active if they autostart and `stop` stays empty.

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
                given = dict(element)
                namespace = given.pop('namespace', None)
                node = kind(context=context, namespace=namespace, parameters=given)
                executor.add_node(node, node.host.log)
                nodes.append(node)
                if node.get_parameter('autostart').value:
                    _start_node(node, executor, stop)
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


def _start_node(node: MemoryNode, executor: GuardedExecutor, stop: Sequence[int]) -> None:
    """Prepare a node while its executor answers other requests, then begin; or until a signal."""
    node.callback_guard.hold_requests()  # while it starts by itself
    prepared = node.prepare()
    prepared.add_done_callback(lambda _: executor.interrupt())
    while not (prepared.done() or stop):
        executor.turn()
    if not stop:
        try:
            node.begin()
        finally:
            node.callback_guard.release_requests()


def spin_nodes(executor: GuardedExecutor, stop: Sequence[object]) -> None:
    """Let nodes work until `stop` is not empty."""
    while not stop:
        executor.turn()


def await_last_clients(
    nodes: Sequence[MemoryNode], executor: GuardedExecutor, stop: Sequence[int]
) -> None:
    """After SIGINT, let nodes work until no client is left, SIGTERM comes, or for their `linger`.

    A terminal and launch stop a robot and its memory together, and the robot may want to write a
    last time.
    """
    longest = max(node.get_parameter('linger').value for node in nodes)
    if longest and signal.SIGTERM not in stop:
        nodes[0].host.log.info(f'serving for at most {longest:g} s, until no client is left')
    begun = seen = now = time.monotonic()
    while signal.SIGTERM not in stop and now - begun < longest and now - seen < CLIENT_ABSENCE_S:
        executor.turn(0.1 * CLIENT_ABSENCE_S)
        now = time.monotonic()
        if any(node.client_count for node in nodes):
            seen = now


def end_nodes(
    nodes: Sequence[MemoryNode],
    executor: GuardedExecutor,
    leaving: Callable[[], object] = lambda: None,
) -> int:
    """Save, answer all requests, then call `leaving`, and leave the ROS graph; return the exit
    status.
    """
    executor.turn(0.01)  # takes what was sent during the start
    waited = any(node.waiting for node in nodes)
    with ThreadPoolExecutor(len(nodes)) as closers:  # a hung disk affects only one element
        list(closers.map(MemoryNode.close, nodes))
    now = time.monotonic()
    expected = waited or any(node.client_count for node in nodes)
    # the middleware delivers what was sent in 0.2 s; pending requests are answered within 1 s
    until, deadline = now + (0.2 if expected else 0.0), now + 1.0
    while now < until or (any(node.waiting for node in nodes) and now < deadline):
        executor.turn(0.01)  # refuses what arrives meanwhile
        now = time.monotonic()
    for node in nodes:
        node.host.log.info('shut down; not all was saved' if node.host.lost else 'shut down')
    status = NOT_SAVED if any(node.host.lost for node in nodes) else ENDED
    leaving()
    executor.shutdown()
    for node in nodes:
        node.destroy_node()
    rclpy.try_shutdown(context=nodes[0].context)
    return status


class GuardedExecutor:
    """Spins nodes, whose callbacks let no exception out; what raises is a message."""

    def __init__(self, context: Context | None = None) -> None:
        self._events = create_events_executor(context)
        self._logs: dict[Node, ThrottledLog] = {}
        self._interrupted = Future()

    def add_node(self, node: Node, log: ThrottledLog) -> None:
        """Spin a node from now on, and log what cannot be decoded in its journal."""
        self._logs[node] = log
        self._events.add_node(node)

    def turn(self, seconds: float = 0.1) -> None:
        """Run callbacks for a time, which no signal cuts short, or until interrupted."""
        try:
            self._events.spin_until_future_complete(self._interrupted, seconds)
        except Exception as error:  # the executor forgets requests that came with it
            for node, log in self._logs.items():
                log.warning(f'a message of a node in this process cannot be decoded: {error}')
                _serve_waiting_requests(node, log)
        if self._interrupted.done():
            self._interrupted = Future()

    def interrupt(self) -> None:
        """End this turn, or the next one; from any thread."""
        self._interrupted.set_result(None)

    def shutdown(self) -> None:
        """Stop running callbacks."""
        self._events.shutdown()


def _serve_waiting_requests(node: Node, log: ThrottledLog) -> None:
    """Serve the requests that wait. Topics need no catching up: we take their bytes."""
    for service in node.services:
        for _ in range(1000):  # more than a queue holds, even if some cannot be decoded
            try:
                request, header = service.handle.service_take_request(service.srv_type.Request)
            except Exception as error:
                log.refused('a message', f'it cannot be decoded: {error}')
            else:
                if request is None:
                    break
                answer = service.callback(request, service.srv_type.Response())
                service.send_response(answer, header)


def exit_within(seconds: float) -> None:
    """End this process with its traceback and exit status 1 after a time in seconds, unless it has
    ended by then.
    """
    with contextlib.suppress(RuntimeError, ValueError, OSError):  # without a stderr
        faulthandler.dump_traceback_later(seconds, exit=True)
