# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A client of a memory node, for programs that are no node themselves."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from typing import Any

import rclpy
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from std_srvs.srv import Trigger

POLL = 0.05
"""Seconds between two looks at the clock while waiting for an answer."""


class NoAnswer(Exception):
    """The node, or an answer of it, did not come in time."""


class RequestFailed(Exception):
    """The node refused a request or could not fulfil it.

    Attributes:
        answer: The node's JSON object, with `error`.
    """

    def __init__(self, answer: dict[str, Any]) -> None:
        super().__init__(answer.get('error', 'the node gave no reason'))
        self.answer = answer


class MemoryClient:
    """Writes, reads and erases the element behind a memory node; a context manager.

    Attributes:
        name: Full name of the memory node.
        node: The client's own node, for subscriptions; it turns while a request waits.
    """

    def __init__(self, name: str = 'mlmem') -> None:
        """Join the ROS graph.

        Args:
            name: Name of the memory node, with its namespace if it has one.
        """
        self.name = name if name.startswith('/') else f'/{name}'
        self._context = Context()
        rclpy.init(context=self._context, signal_handler_options=SignalHandlerOptions.NO)
        self.node = Node(
            f'{self.name.rpartition("/")[2]}_client_{time.time_ns() % 10**9}',
            context=self._context,
            use_global_arguments=False,
            start_parameter_services=False,
        )
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        self._parameters = self.node.create_client(SetParameters, f'{self.name}/set_parameters')
        self._services = {
            service: self.node.create_client(Trigger, f'{self.name}/{service}')
            for service in ('write', 'read', 'erase', 'calibrate', 'abort')
        }

    def __enter__(self) -> MemoryClient:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Leave the ROS graph."""
        self._executor.shutdown()
        self.node.destroy_node()
        rclpy.try_shutdown(context=self._context)

    def wait_for_node(self, timeout: float = 10.0) -> None:
        """Wait until the node's services are there.

        Raises:
            NoAnswer: They are not within `timeout` seconds.
        """
        deadline = time.monotonic() + timeout
        for client in (*self._services.values(), self._parameters):
            if not client.wait_for_service(max(0.0, deadline - time.monotonic())):
                raise NoAnswer(
                    f'no memory node answers as {self.name} within {timeout:g} s; start one with '
                    f'"ros2 run mlmem_ros memory_node", and mind ROS_DOMAIN_ID and the name'
                )

    def write(self, level: int, timeout: float = 60.0) -> dict[str, Any]:
        """Write a level, verified by an echo.

        Args:
            level: 0 ... p - 1.
            timeout: Longest wait for the answer in seconds.

        Returns:
            The node's answer: level, code, delay, margins, attempts, ticks.

        Raises:
            RequestFailed: The node refused, or the level was not reached.
            NoAnswer: No answer came in time.
        """
        value = ParameterValue(type=ParameterType.PARAMETER_INTEGER, integer_value=level)
        request = SetParameters.Request(parameters=[Parameter(name='target_level', value=value)])
        result = self._call(self._parameters, request, timeout).results[0]
        if not result.successful:
            raise RequestFailed({'error': f'level {level} was refused: {result.reason}'})
        return self._trigger('write', timeout)

    def read(self, timeout: float = 10.0) -> dict[str, Any]:
        """Fire a pulse and return the decoded level; raises as `write`."""
        return self._trigger('read', timeout)

    def erase(self, timeout: float = 60.0) -> dict[str, Any]:
        """Make the element blank; raises as `write`."""
        return self._trigger('erase', timeout)

    def calibrate(self, timeout: float = 120.0) -> dict[str, Any]:
        """Learn the delay of every level; raises as `write`."""
        return self._trigger('calibrate', timeout)

    def abort(self, timeout: float = 10.0) -> dict[str, Any]:
        """Stop the running procedure; raises as `write`."""
        return self._trigger('abort', timeout)

    def wait_until(self, condition: Callable[[], bool], timeout: float = 10.0) -> None:
        """Turn the client's node until a condition holds.

        Raises:
            NoAnswer: It does not within `timeout` seconds.
        """
        deadline = time.monotonic() + timeout
        while not condition():
            if time.monotonic() > deadline:
                raise NoAnswer(f'{self.name} did not answer within {timeout:g} s')
            self._executor.spin_once(timeout_sec=POLL)

    def spin(self, duration: float) -> None:
        """Turn the client's node for a while, in seconds."""
        end = time.monotonic() + duration
        while (left := end - time.monotonic()) > 0.0:
            self._executor.spin_once(timeout_sec=left)

    def _trigger(self, service: str, timeout: float) -> dict[str, Any]:
        response = self._call(self._services[service], Trigger.Request(), timeout)
        answer: dict[str, Any] = json.loads(response.message)
        if not response.success:
            raise RequestFailed(answer)
        return answer

    def _call(self, client: Any, request: Any, timeout: float) -> Any:
        if not client.service_is_ready():
            self.wait_for_node()
        future = client.call_async(request)
        self.wait_until(future.done, timeout)
        return future.result()
