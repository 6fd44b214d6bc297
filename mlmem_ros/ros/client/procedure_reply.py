# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A requested procedure: a reply that also reports its progress, and can be cancelled.

It speaks an action's protocol by its services: an `ActionClient` of rclpy adds a topic per
procedure, and cannot drop a pending request.
"""

from __future__ import annotations

from collections import deque
from collections.abc import AsyncGenerator, Callable, Mapping, Sequence
from concurrent.futures import Future
from typing import Any, TypeVar
from uuid import uuid4

from action_msgs.msg import GoalInfo
from action_msgs.srv import CancelGoal
from rcl_interfaces.srv import SetParametersAtomically
from unique_identifier_msgs.msg import UUID

from ...contract.calls import RequestRefused, parse_result
from .node_connection import NodeConnection
from .reply import Reply, Suspension
from .request import Request, Steps

T = TypeVar('T')

MAX_WAITING_REQUESTS = 20
"""Most requests of a client that wait for one another."""

CANCEL_TIMEOUT_S = 60.0
"""Longest wait in seconds for a node to take a cancel."""


class ProcedureReply(Reply[T]):
    """A requested procedure: a goal of the node's action if there is one, else a service call.

    Use it like any reply. If the node serves actions, it gives feedback meanwhile::

        goal = self.memory.write(5)
        async for feedback in goal:
            self.get_logger().info(f'{feedback.phase} {feedback.share:.0%}')
        content = await goal
    """

    def __init__(
        self,
        connection: NodeConnection,
        name: str,
        action: Any,
        arguments: Mapping[str, Any],
        kind: type[Any],
        after: Sequence[Reply[Any]],
        service: Callable[[Request], Steps[T]],
        timeout: float,
        what: str = '',
    ) -> None:
        """Wait for others and for the node; then ask for its action, or else its service."""
        self._path, self._action = f'{name}/_action', action
        self._number = UUID(uuid=list(uuid4().bytes))
        self._accepted = self._unwanted = False
        goal = action and action.Goal(**arguments)

        def steps(request: Request) -> Steps[T]:
            if len(after) >= MAX_WAITING_REQUESTS:
                waiting = f'busy: {MAX_WAITING_REQUESTS} requests are already waiting'
                raise RequestRefused({'error': waiting})
            yield from request.wait_for([each.freed for each in after])
            yield from request.call('request', SetParametersAtomically)
            if not self._is_goal():
                return (yield from service(request))
            impl = action.Impl
            message = impl.SendGoalService.Request(goal_id=self._number, goal=goal)
            path = f'{self._path}/send_goal'
            if not (yield from request.call(path, impl.SendGoalService, message)).accepted:
                raise RequestRefused({'error': 'the node already has a goal with this id'})
            self._accepted = True
            if self._unwanted:
                self._cancel_goal()
            message = impl.GetResultService.Request(goal_id=self._number)
            path = f'{self._path}/get_result'
            response = yield from request.call(path, impl.GetResultService, message)
            answer: T = parse_result(name, kind, response.result, goal)
            return answer

        super().__init__(connection, what or name, steps, timeout)

    def cancel_goal(self) -> bool:
        """Make the node stop this procedure, and nothing else, and release the strain.

        The reply then raises `RequestFailed`, once the strain is zero.

        Returns:
            Whether that is possible. Once it was requested without actions it is not;
            `MemoryClient.abort` stops whatever runs.
        """
        if self._action is None or self.done():
            return False
        self._connection.thread.post(self._cancel_goal)
        return True

    def cancel(self) -> bool:
        """Give up the answer, and cancel the goal."""
        self.cancel_goal()
        return super().cancel()

    async def __aiter__(self) -> AsyncGenerator[Any, None]:
        """Yield the node's feedback; what came before the first wait is lost."""
        if self._action is None:
            return
        feedback: deque[Any] = deque()
        suspensions: list[Suspension] = []

        def wake_waiter(_: Any = None) -> None:
            while suspensions:
                suspensions.pop().resume()

        def take_message(message: Any) -> None:
            if message.goal_id == self._number:
                feedback.append(message.feedback)
                wake_waiter()

        def subscribe() -> None:
            path, kind = f'{self._path}/feedback', self._action.Impl.FeedbackMessage
            receivers = self._connection.get_receivers(path, kind)
            receivers.add(take_message)
            Future.add_done_callback(self, lambda _: receivers.discard(take_message))

        self._connection.thread.post(subscribe)
        Future.add_done_callback(self, wake_waiter)
        while feedback or not self.done():
            if feedback:
                yield feedback.popleft()
                continue
            suspensions.append(suspension := Suspension(self._connection.node))
            if not (feedback or self.done()):  # nothing has come meanwhile
                await suspension

    # --- in the client's thread -------------------------------------------------------------

    def _is_goal(self) -> bool:
        """Return whether the node serves the action."""
        if self._unwanted:
            raise RequestRefused({'error': f'{self._what} was canceled before it was sent'})
        if not self._connection.has_service(f'{self._path}/send_goal'):
            self._action = None
        return self._action is not None

    def _cancel_goal(self) -> None:
        """Ask the node to cancel the goal once it was accepted; its result says how it ended."""
        self._unwanted = True
        if not self._accepted:
            return
        message = CancelGoal.Request(goal_info=GoalInfo(goal_id=self._number))

        def steps(request: Request) -> Steps[Any]:
            return (yield from request.call(f'{self._path}/cancel_goal', CancelGoal, message))

        Reply(self._connection, f'cancel {self._what}', steps, CANCEL_TIMEOUT_S)
