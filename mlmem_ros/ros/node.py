# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The memory node: a device in real time behind topics, services and parameters."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rclpy.node import Node

from ..device import Event, Loop, new_element
from ..device.loop import Stamped
from . import parameters
from .diagnostics import Diagnostics
from .inlets import Inlets
from .outlets import Outlets
from .recording import Recording
from .services import Services


class MemoryNode(Node):
    """One mechanical memory element as a ROS 2 node; all its names are private (`~/...`)."""

    def __init__(self, name: str = 'mlmem', **options: Any) -> None:
        """Declare the parameters, build the device and let its time run.

        Args:
            name: Name of the node, unless a remapping gives another.
            options: For `rclpy.node.Node`.

        Raises:
            ParameterError: A parameter has the wrong type or is out of range.
            DesignError: The design's parameters make no memory.
            SettingsError: Settings contradict each other, or a level gives no echo.
            BagError: The session cannot be recorded where `record.path` says.
        """
        super().__init__(name, **options)
        given = parameters.declare(self)
        self.get_logger().info('preparing the kernels (they are compiled at the first start)')
        self._element = new_element(given.design, given.settings)
        self.loop = Loop(self._element, self._after_tick)
        self._outlets = Outlets(self, self._element, given.publish)
        self._inlets = Inlets(self, self.loop)
        self._diagnostics = Diagnostics(self, self.loop)
        self._recording: Recording | None = None
        if given.record.path:
            self._recording = Recording(self, self._element, given.record)
            self._outlets.tap = self._inlets.tap = self._recording.put
            self._diagnostics.recording = self._recording
        Services(self, self.loop)
        self.loop.start()
        self.get_logger().info(
            f'ready: {given.design.levels} levels, {given.design.N} cells, '
            f'{given.design.substrate} substrate, '
            f'{1e3 * self._element.tick * given.settings.scale.time:g} ms ticks'
        )

    def close(self) -> None:
        """Stop time, refuse who still waits, and close the session file."""
        self.loop.stop()
        if self._recording is not None:
            self._recording.close()

    def _after_tick(self, commands: Sequence[Stamped], events: Sequence[Event]) -> None:
        self._outlets.tick(events)
        self._diagnostics.tick()
        if self._recording is not None:
            self._recording.tick(commands)
