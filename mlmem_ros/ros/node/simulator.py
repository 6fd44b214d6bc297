# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The node in a simulation: the services of the standard package `simulation_interfaces`, and the
pace of /clock, for `use_sim_time`.

As a simulator its time plays, is paused, or is stopped; a test steps it. The package is optional:
where it is not installed, `~/pause` and `~/step` are there alone.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from threading import Condition
from typing import Any

from rclpy.clock import Clock, JumpThreshold, TimeJump
from rclpy.duration import Duration
from rclpy.node import Node

from ...contract.requests import SIMULATOR_SERVICES
from ...contract.topics import Qos, load_installed
from ...host import REFUSALS, Host
from .callback_guard import await_future

STOPPED, PLAYING, PAUSED, _, NO_WORLD = range(5)
"""States of a simulation, as in `SimulationState`: no world is loaded in an unconfigured node."""

UNSUPPORTED, DONE, _, INCORRECT_STATE, FAILED = range(5)
ALREADY, NOT_REACHED = 101, 102
"""Results of a request, as in `Result` and `SetSimulationState`."""


class Simulator:
    """Serves a node's time by the standard, if its types are installed."""

    def __init__(
        self,
        node: Node,
        host: Host,
        begin_anew: Callable[[], None],
        activate: Callable[[bool], None],
    ) -> None:
        """Serve a node's host; it is inactive and blank when it has begun anew, and its time may
        begin paused when it is activated. Both raise one of `REFUSALS` if they cannot.
        """
        self._node, self._host = node, host
        self._begin_anew, self._activate = begin_anew, activate
        kinds = load_installed({service.name: service.type for service in SIMULATOR_SERVICES})
        for name, kind in kinds.items():
            answer = getattr(self, f'_{name}')
            node.create_service(kind, f'~/{name}', answer, qos_profile=Qos.KEEP_ALL.profile)

    @property
    def state(self) -> int:
        """The state of the simulation."""
        host = self._host
        if (loop := host.loop) is not None:
            return PAUSED if loop.is_paused else PLAYING
        return NO_WORLD if host.element is None else STOPPED

    # --- services ------------------------------------------------------------------------

    def _get_simulator_features(self, _: Any, response: Any) -> Any:
        element = self._host.element
        # reset of state and time together
        resets = (20,) if element is None or element.is_simulated else ()
        # state is got, set, paused; stepped once or several times
        response.features.features = [*resets, 24, 25, 26, 31, 32]
        response.features.custom_info = (
            'mlmem_ros: a mechanical memory element; a step is one of its ticks'
        )
        return response

    def _get_simulation_state(self, _: Any, response: Any) -> Any:
        response.state.state, response.result.result = self.state, DONE
        return response

    def _get_entities(self, request: Any, response: Any) -> Any:
        filters = request.filters
        if filters.filter or filters.categories or filters.tags.tags or filters.bounds.type:
            why = 'filters must be empty: a node lists all elements of its process'
            return _set_result(response, UNSUPPORTED, why)
        nodes = [self._node] if self._node.executor is None else self._node.executor.get_nodes()
        response.entities = sorted(
            each.get_fully_qualified_name() for each in nodes if isinstance(each, type(self._node))
        )
        return _set_result(response)

    async def _set_simulation_state(self, request: Any, response: Any) -> Any:
        now, wanted = self.state, request.state.state
        if wanted not in (STOPPED, PLAYING, PAUSED):
            return _set_result(
                response, UNSUPPORTED, 'the state can be stopped, playing or paused'
            )
        stepping = now == PAUSED and self._host.open_loop().is_stepping
        if now == wanted and not stepping:
            return _set_result(response, ALREADY)
        if now == NO_WORLD:
            return _set_result(response, INCORRECT_STATE, 'the node is not configured')
        try:
            if wanted == STOPPED:
                self._begin_anew()
            elif now == STOPPED:
                self._activate(wanted == PAUSED)
            else:
                await await_future(self._host.pause(wanted == PAUSED))
        except REFUSALS as refusal:
            return _set_result(response, NOT_REACHED, f'{refusal}')
        return _set_result(response)

    async def _step_simulation(self, request: Any, response: Any) -> Any:
        stepping = self._host.step(request.steps)
        await await_future(stepping.answer)
        if (done := stepping.asked.done) < request.steps:
            why = f'ended after {done} steps: time was paused or resumed'
            return _set_result(response, FAILED, why)
        return _set_result(response)

    def _reset_simulation(self, request: Any, response: Any) -> Any:
        now = self.state
        if request.scope and ~request.scope & 3:  # the bits of time and state; 0: all
            why = 'state and time are reset together: give the scope 0, 3 or 255'
            return _set_result(response, UNSUPPORTED, why)
        if now == NO_WORLD:
            return _set_result(response, INCORRECT_STATE, 'the node is not configured')
        self._begin_anew()
        if now != STOPPED:
            self._activate(now == PAUSED)
        return _set_result(response)


def _set_result(response: Any, code: int = DONE, why: str = '') -> Any:
    response.result.result, response.result.error_message = code, why
    return response


class SimTimePacer:
    """Follows the node's clock, which /clock advances, mostly by 1 to 100 ms at a time.

    A message that advances it by more than the slack, or sets it back by as much, is a jump: a
    simulator was reset, or started late. No time passes in it, and none is lost.
    """

    slack = 0.5

    def __init__(self, clock: Clock) -> None:
        """Follow a clock, as long as it exists."""
        self.jumps = 0
        self._clock = clock
        self._latest = 0.0
        self._before = 0  # nanoseconds jumped over in all
        self._jumped: int | None = 0  # the same, or None while the clock is set
        slack = Duration(seconds=self.slack)
        back = Duration(seconds=-self.slack)
        self._ran_to = self._seen = 0.0
        self._ran_at = self._seen_at = time.monotonic()
        self._handle = clock.create_jump_callback(  # valid as long as we refer to it
            JumpThreshold(min_forward=slack, min_backward=back, on_clock_change=False),
            pre_callback=self._before_jump,
            post_callback=self._after_jump,
        )

    def now(self) -> float:
        """Return the ROS time in seconds, without its jumps."""
        jumped = self._jumped
        now = self._clock.now().nanoseconds
        if jumped is not None and jumped == self._jumped:  # it is not being set meanwhile
            self._latest = (now - jumped) * 1e-9
        return self._latest

    def wait(self, changed: Condition, seconds: float) -> None:
        """Return soon: whether and how fast ROS time runs is unknown."""
        changed.wait(1e-3)

    def find_problem(self) -> str:
        """Return why time has stood for a while, empty if it runs; call it once a second."""
        now, seen, here = self.now(), self._clock.now().nanoseconds, time.monotonic()
        if now != self._ran_to:
            self._ran_to, self._ran_at = now, here
        if seen != self._seen:
            self._seen, self._seen_at = seen, here
        standstill = 2.0  # seconds for which the clock must have stood
        if here - self._ran_at < standstill:
            return ''
        if not seen:
            return 'use_sim_time is set but no /clock has arrived yet: time stands still'
        if here - self._seen_at >= standstill:
            return '/clock does not advance: time stands still'
        return f'the clock advances in steps of more than {self.slack:g} s: time stands still'

    def _before_jump(self) -> None:
        self._before, self._jumped = self._jumped or 0, None

    def _after_jump(self, jump: TimeJump) -> None:
        self.jumps += 1
        self._jumped = self._before + jump.delta.nanoseconds
