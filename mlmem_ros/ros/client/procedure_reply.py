# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A requested procedure: a reply that also tells how it goes, and can be stopped."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from concurrent.futures import Future
from typing import Any, TypeVar
from uuid import uuid4

from action_msgs.msg import GoalInfo
from action_msgs.srv import CancelGoal
from rcl_interfaces.srv import SetParametersAtomically
from unique_identifier_msgs.msg import UUID

from ...contract.calls import RequestRefused, parse_result
from .node_connection import Call, NodeConnection
from .reply import Reply, ReplySteps, Turn

T = TypeVar('T')

MAX_WAITING_REQUESTS = 20
"""Most requests of a client that wait for one another."""


class ProcedureReply(Reply[T]):
    """A requested procedure: a goal of the node's action if there is one, else a service call.

    Use it like any reply. If the node serves actions, it gives feedback meanwhile::

        goal = self.memory.write(5)
        async for feedback in goal:
            self.get_logger().info(f'{feedback.phase} {feedback.share:.0%}')
        content = await goal
    """

    _lasting = True

    def __init__(
        self,
        connection: NodeConnection,
        name: str,
        action: Any,
        arguments: Mapping[str, Any],
        kind: type[Any],
        after: Sequence[Reply[Any]],
        service: ReplySteps[T],
        timeout: float,
        what: str = '',
    ) -> None:
        """Wait for others and for the node; then ask for its action, or else its service."""
        self._path, self._action = f'{name}/_action', action
        self._number = UUID(uuid=list(uuid4().bytes))
        self._taken = self._unwanted = False
        self._news: deque[Any] = deque()
        self._turn: Turn | None = None
        goal = action and action.Goal(**arguments)
        steps = self._goal_steps(after, name, goal, kind, service)
        super().__init__(connection, what or name, steps, timeout)
        Future.add_done_callback(self, self._wake_waiter)

    def cancel_goal(self) -> bool:
        """Make the node stop this procedure, and nothing else, and release the strain.

        The reply then raises `RequestFailed`, once the strain is zero.

        Returns:
            Whether that is possible. Once it was requested without actions it is not;
            `MemoryClient.abort` stops whatever runs.
        """
        with self._lock:
            if self._action is None or self.done():
                return False
            self._unwanted, taken = True, self._taken
        if taken:
            self._stop()
        return True

    def __aiter__(self) -> ProcedureReply[T]:
        if self._action is not None and not self.done():
            path, kind = f'{self._path}/feedback', self._action.Impl.FeedbackMessage
            takers = self._connection.endpoints().find_receivers(path, kind)
            takers.add(self._take_feedback)
            Future.add_done_callback(self, lambda _: takers.discard(self._take_feedback))
        return self

    async def __anext__(self) -> Any:
        """Wait for the next feedback; what came before the first wait is lost."""
        while not self._news:
            self._turn = turn = Turn(self._connection)
            if self.done():
                raise StopAsyncIteration
            if not self._news:  # none has arrived meanwhile
                await turn
        return self._news.popleft()

    def _goal_steps(
        self, after: Sequence[Reply[Any]], name: str, goal: Any, kind: Any, service: ReplySteps[T]
    ) -> ReplySteps[T]:
        if len(after) >= MAX_WAITING_REQUESTS:
            raise RequestRefused(
                {'error': f'busy: {MAX_WAITING_REQUESTS} requests are already waiting'}
            )
        yield [each.freed for each in after]
        yield Call('request', SetParametersAtomically)
        served = self._connection.endpoints().has_service(f'{self._path}/send_goal')
        with self._lock:  # a client may cancel it in another thread
            if self._unwanted:
                raise RequestRefused({'error': f'{self._what} was canceled before it was sent'})
            self._action = self._action if served else None
        if self._action is None:
            return (yield from service)
        impl = self._action.Impl
        send, get = impl.SendGoalService, impl.GetResultService
        sent = send.Request(goal_id=self._number, goal=goal)
        if not (yield Call(f'{self._path}/send_goal', send, sent)).accepted:
            raise RequestRefused({'error': 'the node already has a goal with this id'})
        with self._lock:
            self._taken, unwanted = True, self._unwanted
        if unwanted:
            self._stop()
        request = get.Request(goal_id=self._number)
        response = yield Call(f'{self._path}/get_result', get, request)
        answer: T = parse_result(name, kind, response.result, goal)
        return answer

    def _has_reached_node(self) -> bool:
        return self._taken or super()._has_reached_node()

    def _stop(self) -> None:
        """Ask to cancel the goal; its result will say how it ended."""
        request = CancelGoal.Request(goal_info=GoalInfo(goal_id=self._number))
        call = Call(f'{self._path}/cancel_goal', CancelGoal, request)
        Reply(self._connection, f'cancel {self._what}', _call_once(call), self._timeout)

    def _take_feedback(self, message: Any) -> None:
        if message.goal_id == self._number:
            self._news.append(message.feedback)
            self._wake_waiter()

    def _wake_waiter(self, _: Any = None) -> None:
        turn, self._turn = self._turn, None
        if turn is not None:
            turn.tell()


def _call_once(call: Call) -> ReplySteps[Any]:
    return (yield call)
