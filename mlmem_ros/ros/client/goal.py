# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A requested procedure: a reply with feedback, which can be canceled."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar
from uuid import uuid4

from action_msgs.msg import GoalInfo
from action_msgs.srv import CancelGoal
from rclpy.task import Future
from unique_identifier_msgs.msg import UUID

from ...contract import results
from ...contract.errors import RequestRefused
from ..qos import RELIABLE
from .awaiting import suspended
from .connection import Call, Connection
from .reply import End, Reply, Steps

T = TypeVar('T')

ClientOf = Callable[[str, Any], Any]
"""Returns the rclpy client of a service below the node's name, of a type."""


MOST = 20
"""Most requests of a client that wait for one another."""


class Action:
    """Access to an action of a node, named like its request.

    Its ROS entities are created on demand.
    """

    def __init__(self, connection: Connection, name: str, kind: Any, client_of: ClientOf) -> None:
        self.name = name
        self._connection = connection
        self._impl, self._goal = kind.Impl, kind.Goal
        self._client_of = client_of
        self._listeners: dict[bytes, Callable[[Any], None]] = {}
        self._subscription: Any = None

    @property
    def served(self) -> bool:
        """Whether the node serves it, as far as is known."""
        node = self._connection.node
        return bool(node.count_services(f'{self._connection.peer}/{self.name}/_action/send_goal'))

    def request(self, arguments: Mapping[str, Any]) -> Any:
        """Return the request that sends a new goal."""
        number = UUID(uuid=list(uuid4().bytes))
        return self._impl.SendGoalService.Request(goal_id=number, goal=self._goal(**arguments))

    def send(self, request: Any) -> Call:
        """Return the call that sends a goal."""
        return Call(self._client('send_goal', self._impl.SendGoalService), request)

    def result(self, number: UUID) -> Call:
        """Return the call that gets an answer when the goal has ended."""
        request = self._impl.GetResultService.Request(goal_id=number)
        return Call(self._client('get_result', self._impl.GetResultService), request)

    def cancel(self, number: UUID) -> None:
        """Ask to cancel a goal; its result will say how it ended."""
        client = self._client('cancel_goal', CancelGoal)
        client.call_async(CancelGoal.Request(goal_info=GoalInfo(goal_id=number)))

    def listen(self, number: UUID, hear: Callable[[Any], None]) -> None:
        """Listen to the feedback of a goal, until `forget`."""
        self._listeners[bytes(number.uuid)] = hear
        if self._subscription is None:
            self._subscription = self._connection.node.create_subscription(
                self._impl.FeedbackMessage,
                f'{self._connection.peer}/{self.name}/_action/feedback',
                self._hear,
                RELIABLE,
                callback_group=self._connection.group,
            )

    def forget(self, number: UUID) -> None:
        """Stop listening to a goal."""
        self._listeners.pop(bytes(number.uuid), None)

    def _hear(self, message: Any) -> None:
        if hear := self._listeners.get(bytes(message.goal_id.uuid)):
            hear(message.feedback)

    def _client(self, service: str, kind: Any) -> Any:
        return self._client_of(f'{self.name}/_action/{service}', kind)


class Goal(Reply[T]):
    """A requested procedure: a goal of the node's action if there is one, else a service call.

    Use it like any reply. If the node serves actions, it gives feedback meanwhile::

        goal = self.memory.write(5)
        async for feedback in goal:
            self.get_logger().info(f'{feedback.phase} {feedback.share:.0%}')
        content = await goal
    """

    def __init__(
        self,
        connection: Connection,
        what: str,
        action: Action | None,
        request: Any,
        kind: type[Any],
        after: Sequence[Reply[Any]],
        there: Call,
        service: Steps[T],
        timeout: float,
    ) -> None:
        """Send the request: wait for others and, with `there`, for the node; then ask it."""
        self._action = action
        self._request = request
        self._taken = self._unwanted = False
        self._news: deque[Any] = deque()
        self._ended: Future | None = None
        super().__init__(connection, what, self._converse(after, there, kind, service), timeout)

    def cancel_goal(self) -> bool:
        """Make the node stop this procedure, and nothing else, and release the strain.

        The reply then raises `RequestFailed`, once the strain is zero.

        Returns:
            Whether that is possible. Without actions it is not; `MemoryClient.abort` stops
            whatever runs.
        """
        if self._action is None or self.done() or self.cancelled():
            return False
        self._unwanted = True
        if self._taken:
            self._action.cancel(self._request.goal_id)
        return True

    def __aiter__(self) -> Goal[T]:
        if self._action is not None and not self.done():
            self._action.listen(self._request.goal_id, self._hear)
        return self

    async def __anext__(self) -> Any:
        """Wait for the next feedback; what came before the first wait is lost."""
        while not self._news:
            self._ended = Future(executor=self._connection.node.executor)
            if self.done() or self.cancelled():
                raise StopAsyncIteration
            if not self._news:  # none has arrived meanwhile
                await suspended(self._ended, self._drive)
        return self._news.popleft()

    def _converse(
        self, after: Sequence[Reply[Any]], there: Call, kind: type[Any], service: Steps[T]
    ) -> Steps[T]:
        if len(after) >= MOST:
            raise RequestRefused({'error': f'busy: {MOST} requests are already waiting'})
        yield after[-1:]
        yield there
        if self._action is None or not self._action.served:
            self._action = None
            return (yield from service)
        number = self._request.goal_id
        taken = yield self._action.send(self._request)
        if not taken.accepted:
            raise RequestRefused({'error': 'the node already has a goal with this id'})
        self._taken = True
        if self._unwanted:
            self._action.cancel(number)
        response = yield self._action.result(number)
        goal = self._request.goal
        answer: T = results.answer_of(self._action.name, kind, response.result, goal)
        return answer

    def _hear(self, feedback: Any) -> None:
        self._news.append(feedback)
        self._wake()

    def _settle(self, end: End | None) -> None:
        super()._settle(end)
        if end is not None:
            if self._action is not None:
                self._action.forget(self._request.goal_id)
            self._wake()

    def _wake(self) -> None:
        waits, self._ended = self._ended, None
        if waits is not None:
            waits.set_result(None)
            if (executor := self._connection.node.executor) is not None:
                executor.wake()
