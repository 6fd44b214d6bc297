# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The memory node: a managed node around a host."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from functools import wraps
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rcl_interfaces.msg import SetParametersResult
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.parameter import Parameter

from mlmem import DriverError, DriverHangs, ErrorCode, Event, Refused, SteadyPacer, threads

from ...contract.requests import NODE_SERVICES
from ...host import REFUSALS, Host
from ...host.building import Built
from ...host.settings import Parameters
from ..middleware import Heartbeat, write_log_line
from .actions import serve_actions
from .callback_guard import CallbackGuard, await_future
from .diagnostics import Diagnostics
from .parameters import ParameterSet
from .services import Services, build_session_plan
from .simulator import SimTimePacer, Simulator
from .topics import Publishers, Subscriptions

CHECK_PERIOD_S = 1.0
"""Seconds between two checks of the disk, the intervals and the clock."""


class MemoryNode(LifecycleNode):
    """One mechanical memory element as a managed ROS 2 node; all its names are `~/...`.

    - *configure* checks the design, compiles, builds the device, and restores its saved content,
    - *activate* lets its time run, and records if a path is set,
    - *deactivate* aborts any procedure, brings the strain to zero, and saves the content,
    - *cleanup* releases the device.

    A failed transition says why and leaves the node in its previous state; a device that fails
    while active, and a fault of the software in a transition, leave it unconfigured.

    `memory_node` is a process of it. It also goes into a program of your own, in any executor,
    beside other nodes::

        with MemoryNode(parameters={'state.path': 'element.json'}) as memory:
            executor.add_node(memory)
            executor.add_node(robot)
            executor.spin()

    The block configures and activates it, unless `autostart` is false, and ends with its content
    saved. A callback in the same executor must await replies, not wait for them.

    Attributes:
        host: Holds the element; it is independent of ROS.
        callback_guard: Answers its requests, or holds them.
    """

    def __init__(
        self,
        name: str = 'mlmem',
        *,
        parameters: Mapping[str, bool | int | float | str] | None = None,
        **options: Any,
    ) -> None:
        """Declare parameters, services and command topics; given parameters take the place of
        those of the command line, and options go to `rclpy.lifecycle.LifecycleNode`.

        Raises:
            SettingsError: A parameter has the wrong type or is out of range, or settings
                contradict each other.
        """
        given = [Parameter(key, value=value) for key, value in (parameters or {}).items()]
        super().__init__(name, parameter_overrides=given, **options)
        self.host = Host(
            self.write_line,
            lambda: self.get_clock().now().nanoseconds,
            name=self.get_fully_qualified_name(),
            failed=lambda: self._call_in_executor(self._handle_failure),
        )
        self.callback_guard = callback_guard = CallbackGuard(self, self.host.log)
        try:
            self._given = ParameterSet(self, self.host)
        except BaseException:
            self.destroy_node()
            raise
        Heartbeat.start_heartbeat(self, self._build_heartbeat)
        Subscriptions(self, self.host)
        self._actions = serve_actions(self, self.host)  # before ~/request: who sees it sees them
        Services(
            self, self.host, lambda path: build_session_plan(self, self._given.values(), path)
        )
        Simulator(self, self.host, self._begin_anew, self._activate_device)
        Diagnostics(self, self.host, callback_guard)
        self._published: Publishers | None = None
        self._starting = self._blank = self._held = False
        self._refusal: Exception | None = None
        self._building: Future[Built] | None = None  # the device, in a thread of its own
        self._prepared: Future[None] | None = None  # done, in the executor, when it is built
        self._away_since: float | None = None  # while the node waits for its element
        self._next_attempt = 0.0
        callback_guard.call_every(CHECK_PERIOD_S, 'checking disks and clock', self._on_timer)
        for service in self.services:
            if service.srv_name.endswith('/change_state'):
                service.callback = self._change_state_when_prepared(service.callback)
        callback_guard.guard_services()
        if self.get_parameter('service_configure_introspection').value != 'disabled':
            self._given.configure_introspection()

    def set_parameters_atomically(self, parameter_list: list[Parameter]) -> SetParametersResult:
        """Set parameters, all or none; an unknown one is refused by its name."""
        self._given.check_names(parameter_list)
        return super().set_parameters_atomically(parameter_list)

    def _build_heartbeat(self) -> DiagnosticStatus:
        """Return what the node's clients are told of it; from any thread."""
        preparing, held_up = self.host.preparing, self.host.held_up
        level = DiagnosticStatus.WARN if held_up else DiagnosticStatus.OK
        return DiagnosticStatus(
            level=DiagnosticStatus.STALE if preparing else level,
            name=self.get_fully_qualified_name(),
            message=preparing or held_up,
        )

    def write_line(self, severity: str, text: str) -> None:
        """Write a line to the node's log."""
        write_log_line(self.get_logger().name, severity, text)

    def __enter__(self) -> MemoryNode:
        try:
            if self.get_parameter('autostart').value:
                self.begin()
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
        if self.executor is not None:
            self.executor.remove_node(self)
        self.destroy_node()

    def begin(self) -> None:
        """Configure and activate; with `device.retry`, wait for an element that is missing.

        Raises:
            One of `REFUSALS`: The transition that failed.
        """
        try:
            self._run_transitions(self.trigger_configure, self.trigger_activate)
        except DriverError as error:
            if not self._await_element(error):
                raise
            return
        since, self._away_since = self._away_since, None
        if since is not None:
            waited = time.monotonic() - since
            self.host.log.warning(f'the element is back after {waited:.3g} s')

    def prepare(self) -> Future[None]:
        """Build the device in a thread of its own, for the next `on_configure` to take.

        Kernels take many seconds to compile and a rig may take as long to answer: meanwhile the
        executor, which must spin in another thread, answers other requests. `on_configure` says
        why the device could not be built.
        """
        if self._prepared is None:
            self._given.locked = True
            self._prepared = Future[None]()
            self._building = threads.run_in_thread(
                lambda: self._build_device(self._given.values())
            )
            self._building.add_done_callback(
                lambda _: self._call_in_executor(self._finish_preparation)
            )
        return self._prepared

    def _call_in_executor(self, function: Callable[[], None]) -> None:
        """Have the executor call a function; without one, nobody does."""
        if (executor := self.executor) is not None:
            executor.create_task(function)

    def _finish_preparation(self) -> None:
        prepared, self._prepared, self._given.locked = self._prepared, None, False
        if prepared is not None:
            prepared.set_result(None)

    def _change_state_when_prepared(self, change_state: Callable[..., Any]) -> Callable[..., Any]:
        """Return a callback that prepares the node before it configures it."""

        @wraps(change_state)  # its errors are those of rclpy's own services
        async def serve_request(
            request: ChangeState.Request, response: ChangeState.Response
        ) -> Any:
            await self.callback_guard.wait_while_held()  # while the node starts by itself
            label, number = request.transition.label, request.transition.id
            configures = label == 'configure' or (
                not label and number == Transition.TRANSITION_CONFIGURE
            )
            if self.unconfigured and (configures or self._prepared is not None):
                await await_future(self.prepare())
            try:
                return change_state(request, response)
            finally:
                self._discard_device()

        return serve_request

    def _discard_device(self) -> None:
        """Release a device that was built, but not configured."""
        if (building := self._building) is not None and building.done():
            self._building = None
            if building.exception() is None:
                self.host.discard_device(building.result())

    def _build_device(self, given: Parameters, blank: bool = False) -> Built:
        return self.host.prepare_device(given, blank, is_retry=self._away_since is not None)

    def _run_transitions(
        self, *transitions: Callable[[], Any], blank: bool = False, held: bool = False
    ) -> None:
        """Make some transitions of the life cycle, in the executor's thread."""
        self._starting, self._refusal = True, None
        self._blank, self._held = blank, held
        try:
            for transition in transitions:
                if transition() != TransitionCallbackReturn.SUCCESS and self._refusal is not None:
                    raise self._refusal
        finally:
            self._starting = self._blank = self._held = False

    def _begin_anew(self) -> None:
        """Replace the present element by a new one, with `initial_content` or blank; inactive."""
        if self.host.element is not None and not self.host.element.is_simulated:
            why = 'a real element cannot be reset; erase it'
            raise Refused(ErrorCode.UNSUPPORTED, reason=why)
        if self.host.loop is not None:
            self._run_transitions(self.trigger_deactivate)
        self._run_transitions(self.trigger_cleanup, self.trigger_configure, blank=True)

    def _activate_device(self, paused: bool) -> None:
        self._run_transitions(self.trigger_activate, held=paused)

    @property
    def unconfigured(self) -> bool:
        """Whether the node is in that state."""
        return bool(self._state_machine.current_state[1] == 'unconfigured')

    @property
    def waiting(self) -> int:
        """How many requests have not been answered yet."""
        goals = sum(action.waiting for action in self._actions)
        return len(self.callback_guard.waiting) + goals

    @property
    def client_count(self) -> int:
        """How many clients of its requests are on the ROS graph."""
        names = [self.resolve_service_name(service.srv_name) for service in self.services]
        own = {'send_goal', *(service.name for service in NODE_SERVICES)}  # not of parameters
        asked = [name for name in names if name.rpartition('/')[2] in own]
        return sum(map(self.count_clients, asked))

    def close(self) -> None:
        """Stop time if it runs, save the content, close the session file."""
        self._away_since = None
        with self.host.log.guard_errors('closing'):
            self.host.close()
        self._discard_device()
        self.callback_guard.release_requests()
        self._release_publishers()

    def destroy_node(self) -> None:
        """Leave the graph now; rclpy would wait until the node's states are garbage-collected."""
        super().destroy_node()
        self._state_machine.destroy_when_not_in_use()

    # --- transitions ---------------------------------------------------------------------

    def on_configure(self, _: LifecycleState) -> TransitionCallbackReturn:
        """Build the device."""
        return self._attempt_transition('configure', self._configure_device)

    def on_activate(self, _: LifecycleState) -> TransitionCallbackReturn:
        """Start time."""
        return self._attempt_transition('activate', self._start_time)

    def on_deactivate(self, _: LifecycleState) -> TransitionCallbackReturn:
        """Hold the state, at zero strain."""
        return self._attempt_transition('deactivate', self._deactivate_device)

    def on_cleanup(self, _: LifecycleState) -> TransitionCallbackReturn:
        """Release the device."""
        return self._attempt_transition('clean up', self._clean_up)

    def on_shutdown(self, _: LifecycleState) -> TransitionCallbackReturn:
        """Hold, save and release."""
        return self._attempt_transition('shut down', self.close)

    def on_error(self, _: LifecycleState) -> TransitionCallbackReturn:
        """Release a device that failed: the node is unconfigured afterwards."""
        failure = self.host.failure
        with self.host.log.guard_errors('handling an error'):
            self.host.release_failed()
        self._release_publishers()
        self._await_element(failure)
        return TransitionCallbackReturn.SUCCESS

    def _attempt_transition(
        self, transition: str, work: Callable[[], None]
    ) -> TransitionCallbackReturn:
        try:
            work()
        except REFUSALS as error:
            self._refusal = error
            if self.host.failure is not None:
                return TransitionCallbackReturn.ERROR
            if not self._starting:
                self.host.log.error(f'cannot {transition}: {error}')
            return TransitionCallbackReturn.FAILURE
        except Exception as error:
            self._refusal = error
            self.host.log.exception(transition, error)
            return TransitionCallbackReturn.ERROR
        return TransitionCallbackReturn.SUCCESS

    # --- what they do --------------------------------------------------------------------

    def _configure_device(self) -> None:
        building, self._building = self._building, None
        given = self._given.values()
        built = self._build_device(given, self._blank) if building is None else building.result()
        element = self.host.adopt_device(built)
        self._given.lock_parameters()
        self._published = Publishers(self, element, given.publish, self.host)
        words = f'{element.reader.content_count} words, ' if given.settings.holds_words else ''
        self.host.log.info(
            f'ready: {given.design.levels} levels, {words}{given.design.N} cells, '
            f'{given.design.substrate} substrate, '
            f'{1e3 * given.settings.tick_seconds:g} ms ticks'
        )

    def _start_time(self) -> None:
        given, published = self._given.values(), self._published
        assert published is not None

        def publish_tick(events: Sequence[Event]) -> None:
            published.publish_tick(events)
            for action in self._actions:
                action.publish_feedback()

        simulated = self.get_parameter('use_sim_time').value
        self.host.activate(
            given,
            build_session_plan(self, given),
            publish_tick,
            SimTimePacer(self.get_clock()) if simulated else SteadyPacer(),
            self.get_parameter('time.speed').value,
            published.has_subscribers,
            published.find_period,
            self._held,
        )
        self.host.log.info('active: time is paused' if self._held else 'active: time runs')

    def _deactivate_device(self) -> None:
        self.host.deactivate()
        self.host.log.info('inactive: the strain is zero, time stands still')

    def _clean_up(self) -> None:
        self.host.release_device()
        self._release_publishers()
        self.host.log.info('unconfigured: the device is released')

    def _release_publishers(self) -> None:
        if self._published is not None:
            self._published.close()
        self._published = None
        self._given.locked = False

    # --- while active --------------------------------------------------------------------

    def _handle_failure(self) -> None:
        """Leave the active state through error handling, if the device failed: unconfigured."""
        with self.host.log.guard_errors('handling a failure'):
            if self.host.failure is not None:
                self.trigger_deactivate()

    def _on_timer(self) -> None:
        self._handle_failure()
        self.host.on_timer()
        self._retry_start()
        self._check_clock()

    def _await_element(self, why: BaseException | None) -> bool:
        """Try again at intervals after an error, if its element is away and may come back, which
        one with a driver that hangs never does; return whether it will.
        """
        interval = self.get_parameter('device.retry').value  # 0: give up
        lost = isinstance(why, DriverError) and not isinstance(why, DriverHangs)
        if not (lost and interval):
            return False
        now = time.monotonic()
        if self._away_since is None:
            self._away_since = now
            self.host.log.warning(f'waiting for the element, every {interval:g} s: {why}')
        self._next_attempt = now + interval
        waited = f'{now - self._away_since:.0f} s'
        self.host.stopped = f'waiting for the element since {waited}: {why}'
        return True

    def _retry_start(self) -> None:
        """Prepare the device again if it is time; give up if somebody else configures the node."""
        if self._away_since is None or time.monotonic() < self._next_attempt:
            return
        if not (self.get_parameter('device.retry').value and self.unconfigured):
            self._away_since = None
            return
        self._next_attempt = math.inf
        self.prepare().add_done_callback(lambda _: self._start_again())

    def _start_again(self) -> None:
        """Start with the device that has been built, in the executor's thread."""
        if self._away_since is None or not self.unconfigured:  # closed, or configured by others
            self._away_since = None
            return
        try:
            self.begin()
        except REFUSALS as error:
            self._away_since = None
            self.host.log.error(f'the element is back, but cannot be started: {error}')

    def _check_clock(self) -> None:
        """Say in `host.held_up` if simulated time stands still; log that once."""
        before, problem = self.host.held_up, ''
        if self.host.loop is not None and isinstance(self.host.loop.pacer, SimTimePacer):
            problem = self.host.loop.pacer.find_problem()
        if problem not in ('', before):
            self.host.log.warning(problem)
        self.host.held_up = problem
