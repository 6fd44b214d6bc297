# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The actions, if their types are built: goals are handled like requests, with feedback.

An action is three services and two topics (design.ros2.org/articles/actions.html). They are
created here like the node's other services. On the events executor rclpy's own action server gave
no answer within 20 s. It is also a single waitable, in which a message that cannot be decoded
blocks all that follow.
"""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Future
from dataclasses import dataclass, field
from typing import Any

from action_msgs.msg import GoalInfo, GoalStatus, GoalStatusArray
from action_msgs.srv import CancelGoal
from rclpy.node import Node
from rclpy.qos import qos_profile_action_status_default

from mlmem import MemoryElement, Outcome, Refused, Request, threads

from ...contract import answers, requests
from ...contract.requests import REQUEST_ARGUMENTS, build_command
from ...contract.topics import Qos
from ...host import Host
from .callback_guard import await_future
from .topics import build_test_statuses


def serve_actions(node: Node, host: Host) -> list[Action]:
    """Serve the actions, if their types are built and the node is to serve them."""
    kinds = requests.load_action_types() if node.get_parameter('actions').value else {}
    return [Action(node, host, name, kind) for name, kind in kinds.items()]


@dataclass(eq=False)
class ActionGoal:
    """An accepted goal.

    Attributes:
        info: Its id, and when it was accepted.
        request: The request that it makes.
        result: The answer to a result request.
        ended: When it ended, on the steady clock.
        fetched: Whether its result has been requested.
        abort: The abort asked for by its client's cancel, which ends at zero strain.
    """

    info: GoalInfo
    request: Request[Any]
    status: int = GoalStatus.STATUS_EXECUTING
    result: Future[Any] = field(default_factory=lambda: threads.Future())
    ended: float = 0.0
    fetched: bool = False
    abort: Request[Any] | None = None


class Action:
    """One action: its goals, from acceptance until nobody asks for their results any more."""

    def __init__(self, node: Node, host: Host, name: str, kind: Any) -> None:
        """Serve an action, named like the request behind its goals."""
        self._node = node
        self._host = host
        self._name = name
        self._kind = kind
        self._codes = kind.Result
        self._goals: dict[bytes, ActionGoal] = {}
        self._reported = 0.0
        self._lock = threads.Lock()
        own, impl = f'~/{name}/_action', kind.Impl
        for service, type_, callback in (
            ('send_goal', impl.SendGoalService, self._accept_goal),
            ('cancel_goal', impl.CancelGoalService, self._cancel_goals),
            ('get_result', impl.GetResultService, self._send_result),
        ):
            node.create_service(
                type_, f'{own}/{service}', callback, qos_profile=Qos.KEEP_ALL.profile
            )
        self._feedback = node.create_publisher(
            impl.FeedbackMessage, f'{own}/feedback', Qos.RELIABLE.profile
        )
        self._status = node.create_publisher(
            GoalStatusArray, f'{own}/status', qos_profile_action_status_default
        )

    # --- services ------------------------------------------------------------------------

    def _accept_goal(self, request: Any, response: Any) -> Any:
        """Accept a goal like any request: its result reports any error."""
        number = bytes(request.goal_id.uuid)
        now = self._node.get_clock().now().to_msg()
        with self._lock:
            self._drop_old_goals()
            response.accepted = number not in self._goals
            if not response.accepted:
                return response
            asked = self._start_goal(request.goal)
            goal = ActionGoal(GoalInfo(goal_id=request.goal_id, stamp=now), asked)
            self._goals[number] = goal
            self._publish_status()
        response.stamp = now
        asked.answer.add_done_callback(lambda done: self._on_goal_ended(goal, done))
        return response

    def _cancel_goals(self, request: CancelGoal.Request, response: CancelGoal.Response) -> Any:
        """Stop the selected goals, and release the strain; nothing else is stopped."""
        with self._lock:
            meant = list(self._select_goals(request.goal_info))
            stopped = [
                goal for goal in meant if goal.abort is None and not goal.request.answer.done()
            ]
            for goal in stopped:
                goal.status = GoalStatus.STATUS_CANCELING
                goal.abort = self._host.cancel(goal.request)
            if stopped:
                self._publish_status()
        response.goals_canceling = [goal.info for goal in stopped]
        if stopped:
            return response
        if meant:
            response.return_code = CancelGoal.Response.ERROR_GOAL_TERMINATED
        elif any(request.goal_info.goal_id.uuid):
            response.return_code = CancelGoal.Response.ERROR_UNKNOWN_GOAL_ID
        return response

    async def _send_result(self, request: Any, response: Any) -> Any:
        goal = self._goals.get(bytes(request.goal_id.uuid))
        if goal is None:
            response.status = GoalStatus.STATUS_UNKNOWN
            return response
        response.result = await await_future(goal.result)
        goal.fetched = True
        response.status = goal.status
        return response

    def _select_goals(self, info: GoalInfo) -> Iterator[ActionGoal]:
        """Yield the goals selected by a cancel: one, those up to a time, both, or all."""
        number, until = bytes(info.goal_id.uuid), (info.stamp.sec, info.stamp.nanosec)
        everything = not any(number) and until == (0, 0)
        for known, goal in self._goals.items():
            stamp = goal.info.stamp
            early = until != (0, 0) and (stamp.sec, stamp.nanosec) <= until
            if everything or known == number or early:
                yield goal

    def _start_goal(self, goal: Any) -> Request[Any]:
        """Make the request behind a goal, which is any goal message of this action."""
        wanted = {name: getattr(goal, name) for name in REQUEST_ARGUMENTS[self._name]}

        def make_command(element: MemoryElement) -> Any:
            if not goal.deadline >= 0.0:
                raise Refused.out_of_range('deadline', goal.deadline, 'a number of seconds, or 0')
            return build_command(self._name, wanted, element.content_name)

        return self._host.submit_made(make_command, goal.deadline)

    # --- ends ----------------------------------------------------------------------------

    def _on_goal_ended(self, goal: ActionGoal, done: Future[Any]) -> None:
        """Take the end of a goal's procedure, in the thread that delivers it."""
        try:
            result, status = self._judge_result(goal, done)
        except Exception as error:  # answer the client anyway
            self._host.log.exception(self._name, error)
            result = answers.build_result(self._kind, self._codes.FAILED, f'{error}')
            status = GoalStatus.STATUS_ABORTED
        with self._lock:
            abort = goal.abort
        if abort is None or status == GoalStatus.STATUS_SUCCEEDED:
            self._conclude_goal(goal, result, status)
            return
        if result.error_code in (self._codes.FAILED, self._codes.REFUSED):
            result.error_code, status = self._codes.CANCELED, GoalStatus.STATUS_CANCELED
        # the next goal must find the element at rest
        abort.answer.add_done_callback(lambda _: self._conclude_goal(goal, result, status))

    def _conclude_goal(self, goal: ActionGoal, result: Any, status: int) -> None:
        """Answer a request for a goal's result."""
        with self._lock:
            goal.status, goal.ended = status, threads.monotonic()
            self._publish_status()
        goal.result.set_result(result)

    def _judge_result(self, goal: ActionGoal, done: Future[Any]) -> tuple[Any, int]:
        """Return the result and status at the end of a procedure."""
        if (refusal := done.exception()) is not None:
            self._host.log.refused(self._name, refusal)
            result = answers.build_result(self._kind, self._codes.REFUSED, f'{refusal}')
            return result, GoalStatus.STATUS_ABORTED
        outcome: Outcome = done.result()
        if not (outcome.success or outcome.checks):  # a self-test is complete if it failed, too
            result = answers.build_result(self._kind, self._codes.FAILED, outcome.error, outcome)
            return result, GoalStatus.STATUS_ABORTED
        result = answers.build_result(self._kind, outcome=outcome)
        if outcome.checks:
            result.passed = outcome.success
            name = self._node.get_fully_qualified_name()
            result.status = build_test_statuses(outcome, name)
        return result, GoalStatus.STATUS_SUCCEEDED

    def _drop_old_goals(self) -> None:
        """Drop the goals whose results nobody will ask for any more: each status lists all."""
        due = threads.monotonic() - 10.0  # a first request finds the result for 10 s
        for number, goal in list(self._goals.items()):
            if goal.result.done() and (goal.fetched or goal.ended < due):
                del self._goals[number]

    @property
    def waiting(self) -> int:
        """How many goals are open, or have just ended without a request for the result."""
        just_now = threads.monotonic() - 1.0  # the sender of a goal asks for its result within 1 s
        with self._lock:
            return sum(
                not goal.fetched and (not goal.result.done() or goal.ended > just_now)
                for goal in self._goals.values()
            )

    # --- topics --------------------------------------------------------------------------

    def publish_feedback(self) -> None:
        """Publish feedback of the running goal every 0.05 s; called in the loop's thread."""
        if not self._goals or threads.monotonic() - self._reported < 0.05:
            return
        for goal in tuple(self._goals.values()):
            if (feedback := self._host.feedback(goal.request)) is not None:
                self._reported = threads.monotonic()
                message = self._kind.Impl.FeedbackMessage(goal_id=goal.info.goal_id)
                message.feedback = self._kind.Feedback(**feedback._asdict())
                self._feedback.publish(message)

    def _publish_status(self) -> None:
        """Publish the status of all goals; the caller holds the lock, to keep them in order."""
        goals = self._goals.values()
        known = [GoalStatus(goal_info=goal.info, status=goal.status) for goal in goals]
        self._status.publish(GoalStatusArray(status_list=known))
