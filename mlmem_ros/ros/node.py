# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The memory node: a managed node around a device in real time."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.parameter import Parameter

from ..bag.errors import BagError
from ..device import Event, Faults, Loop, MemoryElement, Refused, SettingsError
from ..device.loop import Stamped
from ..device.pacing import SteadyPacer
from ..physics import DesignError, StateError
from .compiling import telling_compilation
from .design_check import check_design
from .diagnostics import Diagnostics
from .fault_parameters import FaultParameters
from .gate import Gate
from .inlets import Inlets
from .memory_file import MemoryFile
from .outlets import Outlets
from .parameters import ParameterError, Parameters, ParameterSet
from .recording import Recording
from .services import Services
from .sessions import Sessions
from .sim_time import SimTimePacer
from .speedometer import Speedometer

REFUSALS = (ParameterError, DesignError, SettingsError, StateError, BagError)
"""What a transition may fail with: the message is for the user."""


class MemoryNode(LifecycleNode):
    """One mechanical memory element as a managed ROS 2 node; all its names are `~/...`.

    configure   checks the design, compiles, builds the device, restores its saved content
    activate    lets its time run and records, if a path says so
    deactivate  aborts what runs, brings the strain to zero, holds the state and saves it
    cleanup     releases the device

    A transition that fails says why and leaves the node in the state it was in; a device that
    fails while active leaves it unconfigured.
    """

    def __init__(self, name: str = 'mlmem', **options: Any) -> None:
        """Declare parameters, services and command topics.

        Args:
            name: Name of the node, unless a remapping gives another.
            options: For `rclpy.lifecycle.LifecycleNode`.

        Raises:
            ParameterError: A parameter has the wrong type or is out of range.
            SettingsError: Settings contradict each other.
        """
        super().__init__(name, **options)
        self._given = ParameterSet(self)
        self.gate = Gate()
        self._inlets = Inlets(self, self.gate)
        self._sessions = Sessions(self, self.gate, self._attach)
        self._requests = Services(self, self.gate, self._sessions)
        self._diagnostics = Diagnostics(self, self.gate)
        self._faults = FaultParameters(self, self.gate)
        self._speedometer = Speedometer(self, self.gate)
        self._element: MemoryElement | None = None
        self._outlets: Outlets | None = None
        self._memory_file: MemoryFile | None = None
        self._starting = False
        self._refusal: Exception | None = None
        self.add_post_set_parameters_callback(self._set_speed)

    def start(self) -> None:
        """Configure and activate, as a node does that starts itself.

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
        return self._requests.waiting

    @property
    def failure(self) -> Exception | None:
        """What stopped the device while active, or None."""
        return self.gate.loop.failure if self.gate.loop else None

    # --- transitions ---------------------------------------------------------------------

    def on_configure(self, _: LifecycleState) -> TransitionCallbackReturn:
        """Build the device."""
        return self._attempt('configure', self._configure)

    def on_activate(self, _: LifecycleState) -> TransitionCallbackReturn:
        """Let time run."""
        return self._attempt('activate', self._activate)

    def on_deactivate(self, _: LifecycleState) -> TransitionCallbackReturn:
        """Hold the state, with no strain."""
        if self.failure is not None:
            return TransitionCallbackReturn.ERROR
        return self._attempt('deactivate', self._deactivate)

    def on_cleanup(self, _: LifecycleState) -> TransitionCallbackReturn:
        """Release the device."""
        self._release()
        return TransitionCallbackReturn.SUCCESS

    def on_shutdown(self, _: LifecycleState) -> TransitionCallbackReturn:
        """Hold, save and release."""
        self.close()
        return TransitionCallbackReturn.SUCCESS

    def on_error(self, _: LifecycleState) -> TransitionCallbackReturn:
        """Release a device that failed: the node is unconfigured afterwards."""
        self.get_logger().error(f'the device has stopped: {self.failure}')
        self.close()
        return TransitionCallbackReturn.SUCCESS

    def close(self) -> None:
        """Stop time where it runs, save the content, close the session file."""
        if self.gate.loop is not None:
            self._deactivate()
        self._release()

    def _attempt(self, transition: str, work: Callable[[], None]) -> TransitionCallbackReturn:
        try:
            work()
        except REFUSALS as error:
            self._refusal = error
            if not self._starting:
                self.get_logger().error(f'cannot {transition}: {error}')
            return TransitionCallbackReturn.FAILURE
        return TransitionCallbackReturn.SUCCESS

    # --- what they do --------------------------------------------------------------------

    def _configure(self) -> None:
        given = self._given.values()
        self.get_logger().info('preparing the device')
        integrator = given.settings.time.integrator
        with telling_compilation(self, given.design, integrator, self._diagnostics.announce):
            check_design(given.design, given.settings, given.check, self.get_logger())
            element, memory_file = self._build(given)
        self._given.lock(given.design.levels)
        self._element, self._memory_file = element, memory_file
        self._faults.element = element
        self._outlets = Outlets(self, element, given.publish)
        self.get_logger().info(
            f'ready: {given.design.levels} levels, {given.design.N} cells, '
            f'{given.design.substrate} substrate, '
            f'{1e3 * element.tick * given.settings.scale.time:g} ms ticks'
        )

    def _build(self, given: Parameters) -> tuple[MemoryElement, MemoryFile]:
        memory_file = MemoryFile(self, given.state, given.files.root, self.gate)
        try:
            element = memory_file.new_element(given.design, given.settings)
            _check_faults(element, given.faults)
            memory_file.restore(element)
        except REFUSALS:
            memory_file.close()
            raise
        return element, memory_file

    def _activate(self) -> None:
        assert self._element is not None
        given = self._given.values()
        self._sessions.open(self._element, given.record)
        sim_time = self.get_parameter('use_sim_time').value
        loop = Loop(
            self._element,
            self._after_tick,
            pacer=SimTimePacer(self.get_clock()) if sim_time else SteadyPacer(),
            speed=self.get_parameter('time.speed').value,
            rest_ticks=given.publish.common_ticks,
            heard_ticks=math.gcd(given.publish.heard_ticks, given.record.hash_every),
        )
        self._faults.begin(loop)
        self.gate.loop = loop
        self._speedometer.begin(loop)
        loop.start()

    def _deactivate(self) -> None:
        loop, self.gate.loop = self.gate.open_loop(), None
        self._speedometer.end(loop)
        loop.finish()
        self._sessions.close()
        if loop.failure is None and self._memory_file is not None:
            self._memory_file.save(loop.element)

    def _release(self) -> None:
        if self._outlets is not None:
            self._outlets.close()
        if self._memory_file is not None:
            self._memory_file.close()
        self._element = self._outlets = self._memory_file = self._faults.element = None
        self._given.locked = False

    # --- while active --------------------------------------------------------------------

    def _after_tick(self, commands: Sequence[Stamped], events: Sequence[Event]) -> None:
        """Publish and record what happened, in the loop's thread."""
        if self._outlets is not None:
            self._outlets.tick(events)
        if (loop := self.gate.loop) is not None:
            self._diagnostics.tick(loop)
        if (recording := self._sessions.current) is not None:
            recording.tick(commands)

    def _attach(self, recording: Recording | None) -> None:
        """Let all that is published and received go into a recording, or into none."""
        assert self._outlets is not None
        self._outlets.tap = self._inlets.tap = recording.put if recording else None
        self._outlets.tap_views = self._given.values().record.views
        self._diagnostics.attach(recording)

    def _set_speed(self, changed: list[Parameter]) -> None:
        for parameter in changed:
            if parameter.name == 'time.speed' and self.gate.loop is not None:
                self.gate.loop.set_speed(parameter.value)


def _check_faults(element: MemoryElement, faults: Faults) -> None:
    try:
        element.specimen(faults)
    except Refused as refusal:
        raise ParameterError(f'parameters {refusal}') from refusal
