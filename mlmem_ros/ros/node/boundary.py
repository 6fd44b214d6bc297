# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The one way in from ROS: whatever comes, no exception leaves a callback, and who asked is told.

An exception that leaves a callback ends rclpy's executor, and the process with it. One that is
raised while a message is taken (a text that is no UTF-8) leaves the callback's group blocked for
good.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from rcl_interfaces.msg import SetParametersResult
from rclpy.clock import Clock, ClockType
from rclpy.executors import SingleThreadedExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node

from ...contract import answers
from ...host import REFUSALS, Journal

EXPECTED = (*REFUSALS, rclpy_implementation.RCLError, ValueError, TypeError)
"""What a bad request may raise in rclpy's own services: a transition that is not open now, a
parameter of no known type."""


class Boundary:
    """Guards the callbacks of a node."""

    def __init__(self, node: Node, journal: Journal) -> None:
        """Guard nothing yet.

        Args:
            node: Whose callbacks.
            journal: Where it is told what was caught.
        """
        self._node = node
        self._journal = journal

    def guarded(self, where: str, callback: Callable[..., None]) -> Callable[..., None]:
        """Return a callback that lets no exception out."""

        def call(*arguments: Any) -> None:
            with self._journal.guarded(where):
                callback(*arguments)

        return call

    def every(self, seconds: float, where: str, callback: Callable[[], None]) -> None:
        """Call back again and again by the machine's clock, also where simulated time stands."""
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._node.create_timer(seconds, self.guarded(where, callback), clock=steady)

    def guard_services(self) -> None:
        """Let no exception out of any service of the node, rclpy's own too; it is answered."""
        for service in self._node.services:
            service.callback = self._answering(service.srv_name, service.callback)

    def _answering(self, name: str, callback: Callable[..., Any]) -> Callable[..., Any]:
        own = callback.__module__.startswith('mlmem_ros')

        async def serve(request: Any, response: Any) -> Any:
            try:
                answer = callback(request, response)
                return await answer if inspect.isawaitable(answer) else answer
            except Exception as error:
                if isinstance(error, REFUSALS if own else EXPECTED):
                    self._journal.refused(name, error)
                else:
                    self._journal.exception(name, error)
                return _excuse(request, response, f'{error}' or type(error).__name__, own)

        return serve


def _excuse(request: Any, response: Any, why: str, own: bool) -> Any:
    """Return a response that says why it is no other, as far as its type can.

    Args:
        request: What was asked.
        response: What had been made of its response.
        why: The reason.
        own: Whether the service is one of ours, which answer with a JSON object.
    """
    told = answers.refusal(why) if own else why
    failed = SetParametersResult(successful=False, reason=told)
    if hasattr(response, 'results') and hasattr(request, 'parameters'):  # as many as asked for
        response.results += [failed] * (len(request.parameters) - len(response.results))
    elif isinstance(getattr(response, 'result', None), SetParametersResult):
        response.result = failed
    elif hasattr(response, 'message'):
        response.success = False
        response.message = told
    elif hasattr(response, 'success'):
        response.success = False
    elif hasattr(response, 'status'):
        response.status = [
            DiagnosticStatus(level=DiagnosticStatus.ERROR, name='self_test', message=why)
        ]
    return response


class GuardedExecutor(SingleThreadedExecutor):
    """Goes on whatever a message holds and whatever a callback raises."""

    def __init__(self, journal: Journal, **options: Any) -> None:
        super().__init__(**options)
        self._journal = journal

    def spin_once(self, timeout_sec: float | None = None) -> None:
        """Do what is to be done next, if anything is within a time."""
        with self._journal.guarded('the executor'):
            super().spin_once(timeout_sec)

    def _take_subscription(self, sub: Any) -> Any:
        return self._taken(sub.topic_name, super()._take_subscription, sub)

    def _take_service(self, srv: Any) -> Any:
        return self._taken(srv.srv_name, super()._take_service, srv)

    def _taken(self, name: str, take: Callable[[Any], Any], entity: Any) -> Any:
        try:
            return take(entity)
        except Exception as error:  # it cannot be decoded: who sent it cannot be told
            self._journal.refused(name, f'the message cannot be decoded: {error}')
            return None
