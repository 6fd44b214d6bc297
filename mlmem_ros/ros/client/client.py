# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The memory in a robot's code: a client on one of the robot's own nodes, or without one."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import rclpy
from diagnostic_msgs.srv import SelfTest
from rcl_interfaces.srv import GetParameters, SetParametersAtomically
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.context import Context
from rclpy.node import Node
from rclpy.parameter import parameter_value_to_python
from rclpy.signals import SignalHandlerOptions
from std_srvs.srv import SetBool, Trigger

from mlmem.procedure_table import PROCEDURES
from mlmem.schema import make_printable

from ...contract.answers import (
    ANSWER_TYPES,
    Answer,
    Calibrated,
    Decoded,
    Done,
    NoAnswer,
    Paused,
    Recorded,
    RequestRefused,
    SelfTested,
    parse_answer,
    parse_self_test,
)
from ...contract.requests import build_parameter, build_request, check_content, load_action_types
from .connection import ClientThread, create_node_name
from .reply import ActionCall, Reply, RequestReply, ServiceCall, check_timeout


class MemoryClient:
    """Writes, reads and erases the element behind a memory node.

    Every method returns a `Reply` at once: await it in an `async def` callback, or `.wait()` for
    it if this thread has nothing else to do. A callback that awaits blocks its callback group
    meanwhile: give it `group`, or the timers of the node's default group stop. One client serves
    one element; create one per element on a node, or a `MemoryBank`.

    Every reply raises `NoAnswer` if the node or its answer does not come in time, `RequestRefused`
    if the node rejected the request and `RequestFailed` if it could not fulfil it. A program
    without a node uses `standalone`. `timeout` is the longest wait for the answer in seconds.

    Attributes:
        node: The node it is built on.
        name: Full name of the memory node.
        group: Callback group for callbacks that await; one of them runs at a time.
    """

    def __init__(
        self, node: Node, name: str = 'mlmem', *, patience: float = 10.0, actions: bool = True
    ) -> None:
        """Build a client on a node; nothing is sent.

        Args:
            name: Name of the memory node; a relative one is resolved in the namespace of `node`,
                and remappings apply.
            patience: How long the memory node may take to appear, in seconds.
            actions: Whether procedures are goals of the node's actions, if it serves them;
                otherwise they give no feedback.
        """
        self.node = node
        self.name = node.resolve_service_name(name)
        self.group = MutuallyExclusiveCallbackGroup()
        self._patience = patience
        self._actions = load_action_types() if actions else {}

    def ready(self, timeout: float = 10.0) -> Reply[None]:
        """Wait at most `timeout` seconds, whatever the patience, until the node is available."""
        call = ServiceCall('request', SetParametersAtomically, None, lambda _: None)
        return RequestReply(self.node, self.name, 'ready', call, timeout, timeout)

    def node_count(self) -> int:
        """Return how many memory nodes of this name are on the graph now: more than one may
        answer.
        """
        return int(self.node.count_publishers(f'{self.name}/alive'))

    def write(self, level: int, timeout: float = 60.0) -> RequestReply[Decoded]:
        """Write a level from 0 to p - 1, or a word of a register, verified by an echo.

        Raises:
            ValueError: The level is not a whole number from 0.
        """
        return self.procedure('write', timeout, content=check_content(level))

    def read(self, timeout: float = 10.0, *, end: str = '') -> RequestReply[Decoded]:
        """Fire a pulse and decode its echo.

        Args:
            end: The end to probe this time: left, right or both; empty for the node's `read.end`.
        """
        return self.procedure('read', timeout, end=end)

    def erase(self, timeout: float = 60.0) -> RequestReply[Decoded]:
        """Make the element blank."""
        return self.procedure('erase', timeout)

    def calibrate(self, timeout: float = 120.0) -> RequestReply[Calibrated]:
        """Measure the echo delay of every level, and restore the content."""
        return self.procedure('calibrate', timeout)

    def self_test(self, timeout: float = 120.0) -> RequestReply[SelfTested]:
        """Write and read every level, test actuator and transducers, and restore the content."""
        return self.procedure('self_test', timeout)

    def abort(self, timeout: float = 10.0) -> Reply[Done]:
        """Stop the running procedure and bring the strain to zero."""
        return self.request('abort', timeout)

    def procedure(self, name: str, timeout: float = 120.0, **arguments: Any) -> RequestReply[Any]:
        """Request any procedure by its name, with its arguments: see `mlmem.procedure_table`.

        Raises:
            ValueError: There is no such procedure, or an argument is not of its type.
        """
        what = ' '.join([name, *(str(value) for value in arguments.values() if value != '')])
        call = _build_request_call(name, timeout, arguments)
        _, *given = call.message.parameters
        values = {each.name: parameter_value_to_python(each.value) for each in given}
        if name == 'self_test':  # its own service reports every check
            call = ServiceCall('self_test', SelfTest, SelfTest.Request(), parse_self_test)
        kind = self._actions.get(name)
        action = ActionCall(name, kind, kind.Goal(**values)) if kind else None
        return self._send(call, timeout, what, action)

    def request(self, name: str, timeout: float = 120.0, **arguments: Any) -> Reply[Any]:
        """Send any request that `~/request` takes, with its arguments; see `contract.requests`.

        Raises:
            ValueError: There is no such request, or an argument is not of its type.
        """
        return self._send(_build_request_call(name, timeout, arguments), timeout, name)

    def pause(self, hold: bool = True, timeout: float = 10.0) -> Reply[Paused]:
        """Pause the element's time, or with `hold` false resume it."""
        message = SetBool.Request(data=bool(hold))
        return self._send(ServiceCall('pause', SetBool, message, _parse_pause), timeout)

    def step(self, timeout: float = 10.0) -> Reply[Paused]:
        """Run one tick while time is paused."""
        return self._send(ServiceCall('step', Trigger, Trigger.Request(), _parse_pause), timeout)

    def follow(
        self,
        times: Sequence[float],
        strains: Sequence[float],
        rates: Sequence[float] = (),
        timeout: float = 10.0,
    ) -> Reply[Answer]:
        """Strain the element along a timed profile.

        The reply comes when the profile is accepted. It is refused if the element cannot follow it
        or a procedure is running.

        Args:
            times: Seconds from the beginning of every point, increasing.
            strains: Strain of every point.
            rates: Strain rate of every point in 1/s, for a smooth profile; none for straight
                lines.
        """
        lists = {'times': times, 'strains': strains, 'rates': rates}
        points: dict[str, Any] = {name: [*map(float, given)] for name, given in lists.items()}
        return self.request('follow', timeout, **points)

    def record(self, on: bool = True, path: str = '', timeout: float = 10.0) -> Reply[Recorded]:
        """Start or stop recording a session.

        Args:
            on: Whether to start.
            path: The bag, on the node's machine; if empty, the node's `record.path`. If it exists,
                the time is added to its name.
        """
        return self.request('record', timeout, on=bool(on), path=path)

    def parameters(self, *names: str, timeout: float = 10.0) -> Reply[dict[str, Any]]:
        """Ask for parameters of the node, such as `element`, by name as in the answer; refused if
        the node lacks one of them.
        """

        def parse_values(response: Any) -> dict[str, Any]:
            if len(response.values) != len(names):  # rclpy sends none if one is unknown
                raise RequestRefused({'error': f'one of {", ".join(names)} is not a parameter'})
            return dict(zip(names, map(parameter_value_to_python, response.values), strict=True))

        message = GetParameters.Request(names=list(names))
        call = ServiceCall('get_parameters', GetParameters, message, parse_values)
        return self._send(call, timeout)

    def set_parameters(self, values: Mapping[str, Any], timeout: float = 10.0) -> Reply[None]:
        """Set parameters of the node that may change while it runs, such as
        `{'faults.actuator_stuck': True}`: all of them at once, or none.

        Returns:
            A reply; it is refused, with the reason, if the node rejects one of them.

        Raises:
            ValueError: A value is none that a parameter takes.
        """

        def check_result(response: Any) -> None:
            if not response.result.successful:
                names = make_printable(', '.join(values), 100)
                raise RequestRefused({'error': f'{names} refused: {response.result.reason}'})

        given = [build_parameter(name, value) for name, value in values.items()]
        kind, message = SetParametersAtomically, SetParametersAtomically.Request(parameters=given)
        call = ServiceCall('set_parameters_atomically', kind, message, check_result)
        return self._send(call, timeout)

    def _send(
        self, call: ServiceCall, timeout: float, what: str = '', action: ActionCall | None = None
    ) -> RequestReply[Any]:
        what, patience = what or call.service, self._patience
        return RequestReply(self.node, self.name, what, call, timeout, patience, action)


def _build_request_call(name: str, timeout: float, arguments: Mapping[str, Any]) -> ServiceCall:
    """Return the call of `~/request` for a request."""
    if name in PROCEDURES:  # which the node need not begin when nobody waits any more
        arguments = {'deadline': check_timeout(timeout), **arguments}

    def parse_result(response: Any) -> Answer:
        kind = ANSWER_TYPES.get(name, Decoded)
        return parse_answer(kind, response.result.successful, response.result.reason)

    message = build_request(name, **arguments)
    return ServiceCall('request', SetParametersAtomically, message, parse_result)


def _parse_pause(response: Any) -> Paused:
    return parse_answer(Paused, response.success, response.message)


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
        create_node_name(),
        context=context,
        use_global_arguments=False,
        start_parameter_services=False,
    )
    thread = ClientThread(node, context)
    try:
        yield MemoryClient(node, name, patience=patience)
    finally:
        rclpy.shutdown(context=context)
        thread.join()


def wait_until(condition: Callable[[], object], what: str, timeout: float = 10.0) -> None:
    """Wait in the program's thread until a condition holds, which callbacks may make true.

    Raises:
        NoAnswer: It does not become true in time.
    """
    deadline = time.monotonic() + timeout
    while not condition():
        if time.monotonic() > deadline:
            raise NoAnswer(f'{what} did not come within {timeout:g} s')
        time.sleep(0.02)
