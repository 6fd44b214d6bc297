# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The memory node: a managed node around a host."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn

from ...device import Event
from ...device.pacing import SteadyPacer
from ...host import REFUSALS, Host
from .actions import served_actions
from .boundary import Boundary
from .compiling import telling_compilation
from .diagnostics import Diagnostics
from .inlets import Inlets
from .namesakes import Namesakes
from .outlets import Outlets
from .parameters import ParameterSet
from .recorded import session_plan
from .services import Services
from .sim_time import SimTimePacer

TEND = 1.0
"""Seconds between two checks of the disk, the intervals and the clock."""


class MemoryNode(LifecycleNode):
    """One mechanical memory element as a managed ROS 2 node; all its names are `~/...`.

    - *configure* checks the design, compiles, builds the device, and restores its saved content,
    - *activate* lets its time run, and records if a path is set,
    - *deactivate* aborts any procedure, brings the strain to zero, and saves the content,
    - *cleanup* releases the device.

    A failed transition says why and leaves the node in its previous state; a device that fails
    while active, and a defect anywhere in a transition, leave it unconfigured.

    Attributes:
        host: Holds the element; it is independent of ROS.
    """

    def __init__(self, name: str = 'mlmem', **options: Any) -> None:
        """Declare parameters, services and command topics.

        Args:
            name: Name of the node, unless a remapping gives another.
            options: For `rclpy.lifecycle.LifecycleNode`.

        Raises:
            SettingsError: A parameter has the wrong type or is out of range, or settings
                contradict each other.
        """
        super().__init__(name, **options)
        self.host = Host(
            self.get_logger(),
            lambda: self.get_clock().now().nanoseconds,
            name=self.get_fully_qualified_name(),
            failed=lambda: self.executor.create_task(self._mind_failure),
        )
        self._boundary = boundary = Boundary(self, self.host.journal)
        try:
            self._given = ParameterSet(self, self.host)
        except BaseException:
            self.destroy_node()
            raise
        self._inlets = Inlets(self, self.host)
        self._actions = served_actions(self, self.host)  # before ~/request: who sees it sees them
        Services(self, self.host)
        self._diagnostics = Diagnostics(self, self.host, boundary)
        self._namesakes = Namesakes(self, self.host.journal, boundary)
        self._outlets: Outlets | None = None
        self._starting = False
        self._awaits_clock = True
        self._refusal: Exception | None = None
        boundary.every(TEND, 'checking disks and clock', self._tend)
        boundary.guard_services()

    def start(self) -> None:
        """Configure and activate, as a node with autostart does.

        Raises:
            One of `REFUSALS`: The transition that failed.
        """
        self._starting = True
        for transition in (self.trigger_configure, self.trigger_activate):
            if transition() != TransitionCallbackReturn.SUCCESS and self._refusal is not None:
                raise self._refusal
        self._starting = False

    @property
    def waiting(self) -> int:
        """How many requests have not been answered yet."""
        goals = sum(action.waiting for action in self._actions)
        return len(self._boundary.waiting) + goals

    def close(self) -> None:
        """Stop time if it runs, save the content, close the session file."""
        with self.host.journal.guarded('closing'):
            self.host.close()
        self._release()

    def destroy_node(self) -> None:
        """Leave the graph now; rclpy would wait until the node's states are garbage-collected."""
        super().destroy_node()
        self._state_machine.destroy_when_not_in_use()

    # --- transitions ---------------------------------------------------------------------

    def on_configure(self, _: LifecycleState) -> TransitionCallbackReturn:
        """Build the device."""
        return self._attempt('configure', self._configure)

    def on_activate(self, _: LifecycleState) -> TransitionCallbackReturn:
        """Start time."""
        return self._attempt('activate', self._activate)

    def on_deactivate(self, _: LifecycleState) -> TransitionCallbackReturn:
        """Hold the state, at zero strain."""
        return self._attempt('deactivate', self.host.deactivate)

    def on_cleanup(self, _: LifecycleState) -> TransitionCallbackReturn:
        """Release the device."""
        return self._attempt('clean up', self._clean_up)

    def on_shutdown(self, _: LifecycleState) -> TransitionCallbackReturn:
        """Hold, save and release."""
        return self._attempt('shut down', self.close)

    def on_error(self, _: LifecycleState) -> TransitionCallbackReturn:
        """Release a device that failed: the node is unconfigured afterwards."""
        with self.host.journal.guarded('handling an error'):
            self.host.fail()
        self._release()
        return TransitionCallbackReturn.SUCCESS

    def _attempt(self, transition: str, work: Callable[[], None]) -> TransitionCallbackReturn:
        try:
            work()
        except REFUSALS as error:
            self._refusal = error
            if self.host.failure is not None:
                return TransitionCallbackReturn.ERROR
            if not self._starting:
                self.host.journal.error(f'cannot {transition}: {error}')
            return TransitionCallbackReturn.FAILURE
        except Exception as error:
            self._refusal = error
            self.host.journal.exception(transition, error)
            return TransitionCallbackReturn.ERROR
        return TransitionCallbackReturn.SUCCESS

    # --- what they do --------------------------------------------------------------------

    def _configure(self) -> None:
        given = self._given.values()
        self.get_logger().info('preparing the device')
        integrator = given.settings.time.integrator
        with telling_compilation(self, given.design, integrator, self._diagnostics.announce):
            element = self.host.configure(given)
        self._given.lock(given.design.levels)
        self._outlets = Outlets(self, element, given.publish, self.host)
        self.get_logger().info(
            f'ready: {given.design.levels} levels, {given.design.N} cells, '
            f'{given.design.substrate} substrate, '
            f'{1e3 * element.tick * given.settings.scale.time:g} ms ticks'
        )

    def _activate(self) -> None:
        given = self._given.values()
        sim_time = self.get_parameter('use_sim_time').value
        self.host.activate(
            given,
            session_plan(self, given.record),
            self._after_tick,
            SimTimePacer(self.get_clock()) if sim_time else SteadyPacer(),
            self.get_parameter('time.speed').value,
            lambda: self._outlets is not None and self._outlets.heard,
        )
        self._awaits_clock = True

    def _clean_up(self) -> None:
        self.host.release()
        self._release()

    def _release(self) -> None:
        if self._outlets is not None:
            self._outlets.close()
        self._outlets = None
        self._given.locked = False

    # --- while active --------------------------------------------------------------------

    def _after_tick(self, events: Sequence[Event]) -> None:
        """Publish what happened, in the loop's thread."""
        if self._outlets is not None:
            self._outlets.tick(events)
        for action in self._actions:
            action.tick()

    def _mind_failure(self) -> None:
        """Leave the active state through error handling: unconfigured."""
        with self.host.journal.guarded('handling a failure'):
            self.trigger_deactivate()

    def _tend(self) -> None:
        self.host.tend()
        simulated = self.get_parameter('use_sim_time').value
        if simulated and self._awaits_clock and self.host.loop is not None:
            self._awaits_clock = False  # logged once per activation
            if not self.get_clock().now().nanoseconds:
                self.host.journal.warning(
                    'use_sim_time is set but no /clock has arrived yet: time stands still'
                )
